// Where the filter does not weigh a measurement but takes it as it is: at the start, over holes in
// the inertial data, and when it was wrong itself.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/navigation/attitude_math.hpp"
#include "mapper/navigation/error_state_filter.hpp"

namespace seastitch {

// With the attitude taken from the device, its error is the device's: minus bias, minus noise.
void ErrorStateFilter::AlignWithDevice() {
  const Eigen::Matrix3d axes = EulerAxes(state_.q_map_imu.toRotationMatrix());
  ErrorMatrix M = ErrorMatrix::Identity();
  M.middleRows<3>(kTilt) = -axes * DeviceErrorRows();
  Apply(M);
  P_.block<3, 3>(kTilt, kTilt) +=
      axes * params_.attitude_white_rad.cwiseAbs2().asDiagonal() * axes.transpose();
}

void ErrorStateFilter::Apply(const ErrorMatrix& M) {
  P_ = (M * P_ * M.transpose()).eval();
  P0_by_dvl_ = (M * P0_by_dvl_ * M.transpose()).eval();
  since_.A = (M * since_.A).eval();
}

void ErrorStateFilter::Coast(double dt_s,
                             const Eigen::Quaterniond& q_map_imu,
                             const InertialRates& now) {
  PropagateCovariance();
  const double sigma = params_.coast_speed_sigma_mps;
  state_.p_map += dt_s * state_.v_map_mps;
  state_.q_map_imu = WithoutDeviceError(q_map_imu);
  rates_ = now;

  ErrorMatrix M = ErrorMatrix::Identity();
  M.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(dt_s);
  M.block<3, 3>(kPosition, kTilt) = -dt_s * Skew(state_.v_map_mps);
  M.middleRows<3>(kVelocity).setZero();
  M.diagonal().tail<kBiasSize>() = (-dt_s * bias_rate_.tail<kBiasSize>()).array().exp();
  Apply(M);
  biases_.array() *= M.diagonal().array();
  P_.diagonal().segment<3>(kPosition).array() += sigma * dt_s * sigma * dt_s;
  P_.diagonal().segment<3>(kVelocity).array() += sigma * sigma;
  P_.diagonal().tail<kBiasSize>().array() +=
      bias_sigma_.tail<kBiasSize>().array().square() *
      (1.0 - M.diagonal().tail<kBiasSize>().array().square());
  AlignWithDevice();
}

// Of the device's attitude, what the filter holds for its error taken off.
Eigen::Quaterniond ErrorStateFilter::WithoutDeviceError(const Eigen::Quaterniond& q_map_imu) const {
  const Eigen::Quaterniond q = WithoutStep(q_map_imu);
  const Eigen::Vector3d error = EulerAxes(q.toRotationMatrix()) * (DeviceErrorRows() * biases_);
  return (QuaternionFromRotationVector(-error) * q).normalized();
}

// The velocity turns with the attitude: that along the vehicle's own axes stays, and with it the
// velocity error as it is defined.
void ErrorStateFilter::TakeAttitude(const Eigen::Quaterniond& q_map_imu,
                                    const Eigen::Vector3d& sigma_rpy_rad) {
  PropagateCovariance();
  SetAttitudeBiasSigma(sigma_rpy_rad);
  const Eigen::Quaterniond before = state_.q_map_imu;
  state_.q_map_imu = WithoutDeviceError(q_map_imu);
  state_.v_map_mps = state_.q_map_imu * (before.conjugate() * state_.v_map_mps);
  AlignWithDevice();
}

// Velocity such that the residual is 0; its error is then what would make it so.
void ErrorStateFilter::TakeVelocity(const Eigen::Vector3d& v_dvl_mps,
                                    const Eigen::Vector3d& sigma_mps) {
  PropagateCovariance();
  const DvlModel model = ModelDvl();
  const Eigen::Matrix3d by_velocity = model.H.middleCols<3>(kVelocity).inverse();
  state_.v_map_mps += by_velocity * (v_dvl_mps - model.expected_mps);
  // Of the scale and mounting by the velocity that was measured, not by that which was wrong.
  const auto H = ModelDvl().H;
  ErrorMatrix M = ErrorMatrix::Identity();
  M.middleRows<3>(kVelocity) = -by_velocity * H;
  M.block<3, 3>(kVelocity, kVelocity).setZero();
  Apply(M);
  P_.block<3, 3>(kVelocity, kVelocity) +=
      by_velocity * sigma_mps.cwiseAbs2().asDiagonal() * by_velocity.transpose();
}

void ErrorStateFilter::TakeDepth(double depth_m, double sigma_m) {
  PropagateCovariance();
  const double lever_m = (state_.q_map_imu * mounting_.p_imu_depth).z();
  state_.p_map.z() = depth_m - lever_m - biases_(kDepthBias);
  ErrorMatrix M = ErrorMatrix::Identity();
  M.row(kPosition + 2).setZero();
  M(kPosition + 2, kDepthBias) = -1.0;
  Apply(M);
  P_(kPosition + 2, kPosition + 2) += sigma_m * sigma_m;
}

void ErrorStateFilter::MovePosition(const Eigen::Vector3d& by_m) { state_.p_map += by_m; }

void ErrorStateFilter::WidenPosition(const Eigen::Matrix3d& by_m2) {
  PropagateCovariance();
  P_.block<3, 3>(kPosition, kPosition) += by_m2;
}

void ErrorStateFilter::ReopenInertialBiases() {
  ReopenBiases(kGyroBias, 3);
  ReopenBiases(kAccelBias, 3);
}

void ErrorStateFilter::ReopenAttitudeBias() { ReopenBiases(kAttitudeBias, 3); }

void ErrorStateFilter::ReopenBiases(int first, int size) {
  PropagateCovariance();
  // Estimates beyond this many sigma were learned from what was wrong.
  constexpr double kPossible = 3.0;
  ErrorMatrix M = ErrorMatrix::Identity();
  for (int i = first; i < first + size; ++i) {
    M(i, i) = 0.0;
    if (std::abs(biases_(i)) > kPossible * bias_sigma_(i)) biases_(i) = 0.0;
  }
  Apply(M);
  for (int i = first; i < first + size; ++i) P_(i, i) = bias_sigma_(i) * bias_sigma_(i);
}

Eigen::Vector3d ErrorStateFilter::DvlResidual(const Eigen::Vector3d& v_dvl_mps) const {
  return v_dvl_mps - ModelDvl().expected_mps;
}

void ErrorStateFilter::LimitSpeed(double limit_mps) {
  PropagateCovariance();
  const double speed_mps = state_.v_map_mps.norm();
  if (speed_mps > limit_mps) state_.v_map_mps *= limit_mps / speed_mps;
  P_.diagonal().segment<3>(kVelocity).array() += limit_mps * limit_mps;
}

// --- two hypotheses of the heading -------------------------------------------------------------

double ErrorStateFilter::HeadingResidual(const Eigen::Quaterniond& q_map_imu) const {
  return AttitudeResidual(q_map_imu).z();
}

double ErrorStateFilter::HeadingResidualSigma() {
  PropagateCovariance();
  ErrorRow H = DeviceErrorRows().row(2);
  H.segment<3>(kTilt) = EulerAxes(state_.q_map_imu.toRotationMatrix()).inverse().row(2);
  const double white = params_.attitude_white_rad.z();
  return std::sqrt(H * P_ * H.transpose() + white * white);
}

// Of a step of the device, which the filter follows or not: the other hypothesis has the heading
// that the filter does not.
void ErrorStateFilter::DoubtHeading(double other_rad) {
  PropagateCovariance();
  if (doubt_rad_ == 0.0) P_(kHeadingDoubt, kHeadingDoubt) = 1.0;
  ErrorMatrix M = ErrorMatrix::Identity();
  M(kTilt + 2, kHeadingDoubt) = other_rad;
  Apply(M);
  doubt_rad_ += other_rad;
}

void ErrorStateFilter::KeepHeadingOverStep(double step_rad) {
  heading_offset_rad_ += step_rad;
  DoubtHeading(step_rad);
}

void ErrorStateFilter::FollowHeadingStep(double step_rad) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(step_rad, Eigen::Vector3d::UnitZ()));
  state_.q_map_imu = (turn * state_.q_map_imu).normalized();
  state_.v_map_mps = turn * state_.v_map_mps;
  DoubtHeading(-step_rad);
}

void ErrorStateFilter::EndHeadingDoubt() {
  PropagateCovariance();
  if (doubt_rad_ == 0.0) return;
  // As a measurement, without noise, that the other hypothesis is wrong.
  const ErrorVector K = P_.col(kHeadingDoubt) / P_(kHeadingDoubt, kHeadingDoubt);
  P_.noalias() -= K * P_.col(kHeadingDoubt).transpose().eval();
  const ErrorRow HA = since_.A.row(kHeadingDoubt);
  since_.A.noalias() -= K * HA;
  P_.row(kHeadingDoubt).setZero();
  P_.col(kHeadingDoubt).setZero();
  heading_offset_rad_ -= heading_offset_rad_ == 0.0 ? 0.0 : doubt_rad_;
  doubt_rad_ = 0.0;
}

}  // namespace seastitch
