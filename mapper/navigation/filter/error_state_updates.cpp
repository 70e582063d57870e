// Measurement models and gates: the expected reading of each sensor, and the derivative of its
// residual by the error state.

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/attitude_math.hpp"
#include "mapper/navigation/filter/error_state_filter.hpp"

namespace seastitch {

// Device = Exp(axes (its error + noise)) true, and true = Exp(tilt) estimate.
Eigen::Vector3d ErrorStateFilter::AttitudeResidual(const Eigen::Quaterniond& q_map_imu) const {
  const Eigen::Vector3d difference =
      RotationVectorFromQuaternion(WithoutStep(q_map_imu) * state_.q_map_imu.conjugate());
  return EulerAxes(state_.q_map_imu.toRotationMatrix()).inverse() * difference -
         DeviceErrorRows() * biases_;
}

int ErrorStateFilter::UpdateAttitude(const Eigen::Quaterniond& q_map_imu,
                                     const Eigen::Vector3d& sigma_rpy_rad) {
  PropagateCovariance();
  SetAttitudeBiasSigma(sigma_rpy_rad);
  const Eigen::Vector3d forward = state_.q_map_imu * Eigen::Vector3d::UnitX();
  if (forward.head<2>().norm() < kMinCosPitch) return 3;
  const Eigen::Matrix3d to_rpy = EulerAxes(state_.q_map_imu.toRotationMatrix()).inverse();
  const AttitudeRows device = DeviceErrorRows();
  const Eigen::Vector3d residual = AttitudeResidual(q_map_imu);
  // Error by the uncertainty of the stamps: the vehicle's rotation in that time.
  const Eigen::Vector3d by_stamp =
      params_.attitude_time_sigma_s * (to_rpy * (state_.q_map_imu * TurnOverGround()));
  int refused = 0;
  for (int i = 0; i < 3; ++i) {
    ErrorRow H = device.row(i);
    H.segment<3>(kTilt) = to_rpy.row(i);
    const double sigma = params_.attitude_white_rad(i);
    const double variance = sigma * sigma + by_stamp(i) * by_stamp(i);
    if (!Offer(NavSensor::kAttitude, i, H, residual(i), variance)) ++refused;
  }
  Inject();
  return refused;
}

// Angular rate without the rotation of the Earth.
Eigen::Vector3d ErrorStateFilter::TurnOverGround() const {
  return rates_.angular_rate_radps - biases_.segment<3>(kGyroBias) -
         state_.q_map_imu.conjugate() * earth_.rate_radps;
}

ErrorStateFilter::DvlModel ErrorStateFilter::ModelDvl() const {
  const Eigen::Matrix3d R_dvl_imu = mounting_.T_imu_dvl.linear().transpose();
  const Eigen::Vector3d p_imu_dvl = mounting_.T_imu_dvl.translation();
  const Eigen::Matrix3d R_dvl_map = R_dvl_imu * state_.q_map_imu.toRotationMatrix().transpose();
  const Eigen::Vector3d v_dvl =
      R_dvl_map * state_.v_map_mps + R_dvl_imu * TurnOverGround().cross(p_imu_dvl);

  const double scale = 1.0 + biases_(kDvlScale);
  const Eigen::Matrix3d mounted =
      QuaternionFromRotationVector(biases_.segment<3>(kDvlMounting)).toRotationMatrix();
  DvlModel model;
  model.expected_mps = scale * (mounted * v_dvl);
  model.H.setZero();
  model.H.middleCols<3>(kVelocity) = scale * mounted * R_dvl_map;
  model.H.middleCols<3>(kGyroBias) = scale * mounted * R_dvl_imu * Skew(p_imu_dvl);
  model.H.col(kDvlScale) = mounted * v_dvl;
  model.H.middleCols<3>(kDvlMounting) = -Skew(model.expected_mps);
  return model;
}

// Adds the error by the uncertainty of the stamps: the change of the velocity in that time, in the
// DVL's axes.
Eigen::Vector3d ErrorStateFilter::DvlSigma(const Eigen::Vector3d& sigma_mps) const {
  const Eigen::Quaterniond to_body = state_.q_map_imu.conjugate();
  const Eigen::Vector3d force = rates_.specific_force_mps2 - biases_.segment<3>(kAccelBias);
  const Eigen::Vector3d change =
      mounting_.T_imu_dvl.linear().transpose() *
      (force + to_body * earth_.gravity_mps2 - TurnOverGround().cross(to_body * state_.v_map_mps));
  const Eigen::Vector3d by_stamp = params_.dvl_time_sigma_s * change;
  return (sigma_mps.array().square() + by_stamp.array().square()).sqrt();
}

int ErrorStateFilter::UpdateDvl(const Eigen::Vector3d& v_dvl_mps,
                                const Eigen::Vector3d& sigma_mps,
                                const DvlStamping& stamping,
                                SlowStates slow) {
  PropagateCovariance();
  const DvlModel model = ModelDvl();
  const Eigen::Vector3d residual = v_dvl_mps - model.expected_mps;
  const Eigen::Vector3d variance = DvlSigma(sigma_mps).cwiseAbs2();
  // All components are refused if one is impossible: they are measured by the same beams.
  InnovationSummary& summary = innovations_[static_cast<std::size_t>(NavSensor::kDvl)].summary;
  int refused = 0;
  for (int i = 0; i < 3; ++i) {
    const double S = model.H.row(i) * P_ * model.H.row(i).transpose() + variance(i);
    if (!(residual(i) * residual(i) <= params_.gate_sigma * params_.gate_sigma * S)) ++refused;
  }
  summary.gated += refused;
  if (refused > 0) return refused;
  estimates_slow_ = slow == SlowStates::kEstimated;
  for (int i = 0; i < 3; ++i)
    if (!Offer(NavSensor::kDvl,
               i,
               model.H.row(i),
               residual(i),
               variance(i),
               stamping.change_mps2(i),
               stamping.carried_s))
      ++refused;
  estimates_slow_ = true;
  Inject();
  return refused;
}

int ErrorStateFilter::UpdateDepth(double depth_m, double sigma_m) {
  PropagateCovariance();
  const Eigen::Vector3d lever = state_.q_map_imu * mounting_.p_imu_depth;
  ErrorRow H = ErrorRow::Zero();
  H(kPosition + 2) = 1.0;
  H.segment<3>(kTilt) = -Skew(lever).row(2);
  H(kDepthBias) = 1.0;
  const double residual = depth_m - (state_.p_map.z() + lever.z()) - biases_(kDepthBias);
  const bool used = Offer(NavSensor::kDepth, 0, H, residual, sigma_m * sigma_m);
  Inject();
  return used ? 0 : 1;
}

int ErrorStateFilter::UpdatePosition(const Eigen::Vector2d& north_east_m,
                                     const Eigen::Matrix2d& covariance_m2) {
  PropagateCovariance();
  const Eigen::Matrix<double, 2, kErrorSize> H = VehicleJacobian().topRows<2>();
  const Eigen::Vector2d residual = north_east_m - T_map_vehicle().translation().head<2>();
  const Eigen::Matrix2d S = H * P_ * H.transpose() + covariance_m2;
  if (doubt_rad_ != 0.0 && DecideHeading(H * ByHeadingDoubt(), residual, S))
    return UpdatePosition(north_east_m, covariance_m2);
  // One gate for both components; then they are used one after the other, whitened so that their
  // noise is independent.
  const double nis = residual.dot(S.llt().solve(residual));
  if (!(nis <= 2.0 * params_.gate_sigma * params_.gate_sigma)) {
    innovations_[static_cast<std::size_t>(NavSensor::kPositionFix)].summary.gated += 2;
    return 2;
  }
  const Eigen::Matrix2d L = covariance_m2.llt().matrixL();
  const Eigen::Matrix2d whiten = L.inverse();
  const Eigen::Vector2d white_residual = whiten * residual;
  const Eigen::Matrix<double, 2, kErrorSize> white_H = whiten * H;
  for (int i = 0; i < 2; ++i)
    Use(NavSensor::kPositionFix, i, white_H.row(i), white_residual(i), 1.0);
  Inject();
  return 0;
}

}  // namespace seastitch
