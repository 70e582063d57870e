// Where the filter does not weigh a measurement but takes it as it is: at the start, over holes in
// the inertial data, and when it was wrong itself.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/attitude_math.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"

namespace seastitch {
namespace {

// By so much, as a difference of squared innovations, one hypothesis has to be the better one.
constexpr double kDecided = 16.0;
// A position that moves by less has not moved.
constexpr double kMoveM = 0.01;

}  // namespace

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
  stamp_error_.by_delay = (M * stamp_error_.by_delay).eval();
  stamp_error_.by_carrying = (M * stamp_error_.by_carrying).eval();
}

bool ErrorStateFilter::IsFinite() const {
  return state_.p_map.allFinite() && state_.v_map_mps.allFinite() &&
         std::abs(state_.q_map_imu.norm() - 1.0) < 1e-6 && biases_.allFinite() && P_.allFinite() &&
         P0_by_dvl_.allFinite() && since_.A.allFinite() && since_.adjoint.allFinite() &&
         (P_.diagonal().array() >= 0.0).all();
}

void ErrorStateFilter::Coast(double dt_s,
                             const std::optional<Eigen::Quaterniond>& q_map_imu,
                             const InertialRates& now) {
  PropagateCovariance();
  const double sigma = params_.coast_speed_sigma_mps;
  state_.p_map += dt_s * state_.v_map_mps;
  if (q_map_imu) state_.q_map_imu = WithoutDeviceError(*q_map_imu);
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
  if (q_map_imu) return AlignWithDevice();
  const double turned_rad = std::min(kCoastTurnRadps * dt_s, kPi / 2.0);
  P_.diagonal().segment<2>(kTilt).array() += kCoastTilt * kCoastTilt;
  P_(kTilt + 2, kTilt + 2) += turned_rad * turned_rad;
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
                                    const Eigen::Vector3d& sigma_mps,
                                    const DvlStamping& stamping) {
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
  const Eigen::Vector3d by_delay = by_velocity * stamping.change_mps2;
  stamp_error_.by_delay.segment<3>(kVelocity) += by_delay;
  stamp_error_.by_carrying.segment<3>(kVelocity) += stamping.carried_s * by_delay;
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

// Of the vehicle; the lever arm to it turns with the tilt.
void ErrorStateFilter::TakePosition(const Eigen::Vector2d& north_east_m,
                                    const Eigen::Matrix2d& covariance_m2) {
  PropagateCovariance();
  const Eigen::Vector3d lever = state_.q_map_imu * mounting_.T_imu_vehicle.translation();
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();
  by_m.head<2>() = north_east_m - T_map_vehicle().translation().head<2>();
  MovePosition(by_m);
  ErrorMatrix M = ErrorMatrix::Identity();
  M.middleRows<2>(kPosition).setZero();
  M.block<2, 3>(kPosition, kTilt) = Skew(lever).topRows<2>();
  Apply(M);
  P_.block<2, 2>(kPosition, kPosition) += covariance_m2;
}

void ErrorStateFilter::MovePosition(const Eigen::Vector3d& by_m) {
  state_.p_map += by_m;
  if (by_m.norm() < kMoveM) return;
  ++moves_.count;
  moves_.way_m += by_m.norm();
}

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
  // Estimates beyond this many sigma came from wrong measurements.
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
  for (int i = kVelocity; i < kVelocity + 3; ++i)
    P_(i, i) = std::max(P_(i, i), limit_mps * limit_mps);
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
  if (doubt_rad_ == 0.0) {
    P_(kHeadingDoubt, kHeadingDoubt) = 1.0;
    ++doubts_;
  }
  ErrorMatrix M = ErrorMatrix::Identity();
  M(kTilt + 2, kHeadingDoubt) = other_rad;
  Apply(M);
  doubt_rad_ += other_rad;
}

// By the other hypothesis the way lies on an arc: what that is more than its tangent, which the
// tilt makes of it.
void ErrorStateFilter::RotateDisplacementByHeadingDoubt() {
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(doubt_rad_, axis).toRotationMatrix();
  const Eigen::Vector3d more_m =
      turn * pending_move_ - pending_move_ - doubt_rad_ * axis.cross(pending_move_);
  ErrorMatrix M = ErrorMatrix::Identity();
  M.block<3, 1>(kPosition, kHeadingDoubt) = more_m;
  Apply(M);
}

ErrorStateFilter::HeadingDoubt ErrorStateFilter::heading_doubt() {
  PropagateCovariance();
  return {doubt_rad_ == 0.0 ? 0 : doubts_, ByHeadingDoubt()};
}

// A step is measured by one attitude.
double ErrorStateFilter::StepVariance() const {
  const double stamp_rad =
      params_.attitude_time_sigma_s * (state_.q_map_imu * TurnOverGround()).z();
  const double white_rad = params_.attitude_white_rad.z();
  return white_rad * white_rad + stamp_rad * stamp_rad;
}

void ErrorStateFilter::KeepHeadingOverStep(double step_rad) {
  P_(kAttitudeBias + 2, kAttitudeBias + 2) += StepVariance();
  heading_offset_rad_ += step_rad;
  DoubtHeading(step_rad);
}

void ErrorStateFilter::FollowHeadingStep(double step_rad) {
  const double turn_rad = step_rad + heading_offset_rad_;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
  state_.q_map_imu = (turn * state_.q_map_imu).normalized();
  state_.v_map_mps = turn * state_.v_map_mps;
  heading_offset_rad_ = 0.0;
  DoubtHeading(-turn_rad);
  P_(kTilt + 2, kTilt + 2) += StepVariance();
}

void ErrorStateFilter::TrustDeviceHeading() {
  if (heading_offset_rad_ != 0.0) P_(kAttitudeBias + 2, kAttitudeBias + 2) += StepVariance();
  heading_offset_rad_ = 0.0;
}

// As a measurement, without noise, of which of the two it is.
void ErrorStateFilter::EndHeadingDoubt(HeadingHypothesis right) {
  PropagateCovariance();
  if (doubt_rad_ == 0.0) return;
  const ErrorVector K = ByHeadingDoubt();
  P_.noalias() -= K * P_.col(kHeadingDoubt).transpose().eval();
  const ErrorRow HA = since_.A.row(kHeadingDoubt);
  since_.A.noalias() -= K * HA;
  stamp_error_.by_delay -= K * stamp_error_.by_delay(kHeadingDoubt);
  stamp_error_.by_carrying -= K * stamp_error_.by_carrying(kHeadingDoubt);
  if (right == HeadingHypothesis::kOther) {
    since_.adjoint += HA.transpose();  // by its variance, which is 1
    correction_ = K;
    MovePosition(K.segment<3>(kPosition));
    correction_.segment<3>(kPosition).setZero();
    P_ += StepVariance() / (doubt_rad_ * doubt_rad_) * K * K.transpose();
    heading_offset_rad_ -= doubt_rad_;
  }
  Inject();
  biases_(kHeadingDoubt) = 0.0;
  P_.row(kHeadingDoubt).setZero();
  P_.col(kHeadingDoubt).setZero();
  doubt_rad_ = 0.0;
}

// Decides by a position: other sensors' information about the heading depends on biases that were
// estimated under one of the two hypotheses. other_m: where the position is off by the other
// hypothesis.
bool ErrorStateFilter::DecideHeading(const Eigen::Vector2d& other_m,
                                     const Eigen::Vector2d& residual_m,
                                     const Eigen::Matrix2d& S) {
  const Eigen::Matrix2d S_own = S - other_m * other_m.transpose();
  const auto nis = [&S_own](const Eigen::Vector2d& r) -> double {
    return r.dot(S_own.llt().solve(r));
  };
  const double own = nis(residual_m);
  const double other = nis(residual_m - other_m);
  const double gate = 2.0 * params_.gate_sigma * params_.gate_sigma;
  if (std::min(own, other) > gate || std::abs(own - other) < kDecided) return false;
  EndHeadingDoubt(own < other ? HeadingHypothesis::kOwn : HeadingHypothesis::kOther);
  return true;
}

}  // namespace seastitch
