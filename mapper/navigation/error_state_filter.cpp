#include "mapper/navigation/error_state_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr int kNavSize = 9;    // position, velocity, tilt
constexpr int kDrivenBy = 15;  // and the two biases that drive them
constexpr int kBiasSize = kErrorSize - kNavSize;
// The error changes slowly beside the state: its covariance takes longer steps than the strapdown.
constexpr double kCovarianceStepS = 0.05;
// Nearer to the vertical than this, roll and yaw of the device cannot be told apart.
constexpr double kMinCosPitch = 0.1;

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Rounding to steps is uniform, variance step^2 / 12, and stays for the correlation time.
double WithRounding(double density, double step, double correlation_s) {
  return density * density + step * step / 12.0 * 2.0 * correlation_s;
}

// Columns: the axes in the map about which roll, pitch and yaw turn a body of this attitude.
Eigen::Matrix3d EulerAxes(const Eigen::Matrix3d& R_map_body) {
  const Eigen::Vector3d forward = R_map_body.col(0);
  Eigen::Matrix3d axes;
  axes.col(0) = forward;
  axes.col(1) = Eigen::Vector3d(-forward.y(), forward.x(), 0.0) /
                std::max(forward.head<2>().norm(), kMinCosPitch);
  axes.col(2) = Eigen::Vector3d::UnitZ();
  return axes;
}

// F differs from the identity in the first nine rows and on the diagonal of the biases only.
using NavRows = Eigen::Matrix<double, kNavSize, kDrivenBy>;
using BiasDecay = Eigen::Matrix<double, kBiasSize, 1>;

// P becomes F P F^T.
void Carry(const NavRows& F, const BiasDecay& decay, ErrorMatrix* P) {
  const Eigen::Matrix<double, kNavSize, kErrorSize> FP = F * P->topRows<kDrivenBy>();
  P->topLeftCorner<kNavSize, kNavSize>() = FP.leftCols<kDrivenBy>() * F.transpose();
  P->topRightCorner<kNavSize, kBiasSize>() = FP.rightCols<kBiasSize>() * decay.asDiagonal();
  P->bottomLeftCorner<kBiasSize, kNavSize>() = P->topRightCorner<kNavSize, kBiasSize>().transpose();
  P->bottomRightCorner<kBiasSize, kBiasSize>().array() *= (decay * decay.transpose()).array();
}

}  // namespace

ErrorStateFilter::ErrorStateFilter(const NavigationParams& params,
                                   const Mounting& mounting,
                                   const EarthModel& earth)
    : params_(params), mounting_(mounting), earth_(earth) {
  gyro_psd_ =
      WithRounding(params.gyro_noise_radps_rthz, params.gyro_step_radps, params.step_correlation_s);
  accel_psd_ =
      WithRounding(params.accel_noise_mps2_rthz, params.accel_step_mps2, params.step_correlation_s);

  const auto set = [this](int index, int size, double sigma, double tau_s) {
    bias_sigma_.segment(index, size).setConstant(sigma);
    bias_rate_.segment(index, size).setConstant(1.0 / tau_s);
  };
  set(kGyroBias, 3, params.gyro_bias_radps.sigma, params.gyro_bias_radps.tau_s);
  set(kAccelBias, 3, params.accel_bias_mps2.sigma, params.accel_bias_mps2.tau_s);
  set(kDvlScale, 1, params.dvl_scale.sigma, params.dvl_scale.tau_s);
  set(kDvlMounting, 3, params.dvl_mounting_rad.sigma, params.dvl_mounting_rad.tau_s);
  set(kAttitudeBias, 2, 0.0, params.attitude_roll_pitch_rad.tau_s);
  set(kAttitudeBias + 2, 1, 0.0, params.attitude_heading_rad.tau_s);
  set(kHeadingWander,
      1,
      params.attitude_heading_wander_rad.sigma,
      params.attitude_heading_wander_rad.tau_s);
  bias_sigma_.segment<2>(kDeviation).setConstant(params.attitude_deviation_rad);
  set(kDepthBias, 1, params.depth_bias_m.sigma, params.depth_bias_m.tau_s);
  SetAttitudeBiasSigma(Eigen::Vector3d::Zero());
}

// The device states one sigma for all that is wrong with its heading: what exceeds the other parts
// is taken as the part that stays.
void ErrorStateFilter::SetAttitudeBiasSigma(const Eigen::Vector3d& sigma_rpy_rad) {
  Eigen::Vector3d floor;
  floor << params_.attitude_roll_pitch_rad.sigma, params_.attitude_heading_rad.sigma;
  const double wander = params_.attitude_heading_wander_rad.sigma;
  const double deviation = params_.attitude_deviation_rad;
  const double stated = sigma_rpy_rad.z();
  const double stays2 = stated * stated - wander * wander - deviation * deviation;
  const Eigen::Vector3d sigma(
      sigma_rpy_rad.x(), sigma_rpy_rad.y(), std::sqrt(std::max(stays2, 0.0)));
  bias_sigma_.segment<3>(kAttitudeBias) = sigma.cwiseMax(floor);
}

AttitudeRows ErrorStateFilter::DeviceErrorRows() const {
  const double yaw = RpyFromRotation(state_.q_map_imu.toRotationMatrix()).z();
  AttitudeRows rows = AttitudeRows::Zero();
  rows.middleCols<3>(kAttitudeBias).setIdentity();
  rows(2, kHeadingWander) = 1.0;
  rows(2, kDeviation) = std::sin(yaw);
  rows(2, kDeviation + 1) = std::cos(yaw);
  return rows;
}

void ErrorStateFilter::Initialise(const Start& start,
                                  const Eigen::Quaterniond& q_map_imu,
                                  const Eigen::Vector3d& sigma_rpy_rad) {
  state_ = {start.p_map_imu, start.v_map_mps, q_map_imu.normalized()};
  biases_.setZero();
  SetAttitudeBiasSigma(sigma_rpy_rad);
  P_.setZero();
  P_.diagonal() = bias_sigma_.cwiseAbs2();
  P_.diagonal().segment<3>(kPosition) = start.sigma_p_m.cwiseAbs2();
  P_.diagonal().segment<3>(kVelocity).setConstant(start.sigma_v_mps * start.sigma_v_mps);
  AlignWithDevice();
  P0_by_dvl_.setZero();
  since_ = {ErrorMatrix::Identity(), ErrorVector::Zero()};
  pending_s_ = 0.0;
  pending_R_.setZero();
  pending_move_.setZero();
}

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

InertialRates ErrorStateFilter::Corrected(const InertialRates& measured) const {
  return {measured.angular_rate_radps - biases_.segment<3>(kGyroBias),
          measured.specific_force_mps2 - biases_.segment<3>(kAccelBias)};
}

void ErrorStateFilter::Propagate(const InertialRates& from, const InertialRates& to, double dt_s) {
  pending_R_ += dt_s * state_.q_map_imu.toRotationMatrix();
  pending_s_ += dt_s;
  const Eigen::Vector3d from_p = state_.p_map;
  state_ = Integrate(state_, Corrected(from), Corrected(to), dt_s, earth_);
  pending_move_ += state_.p_map - from_p;
  rates_ = to;
  if (pending_s_ >= kCovarianceStepS) PropagateCovariance();
}

void ErrorStateFilter::PropagateCovariance() {
  if (pending_s_ <= 0.0) return;
  const double dt = pending_s_;
  const Eigen::Matrix3d R = pending_R_ / dt;
  const Eigen::Matrix3d move = Skew(pending_move_);
  const Eigen::Matrix3d gravity = Skew(earth_.gravity_mps2);
  const Eigen::Matrix3d earth = Skew(earth_.rate_radps);

  // d position = velocity - v x tilt
  // d velocity = -2 earth x velocity + (g + v x earth) x tilt - v x R gyro_bias - R accel_bias
  // d tilt = -earth x tilt - R gyro_bias
  NavRows F;
  F.setZero();
  F.leftCols<kNavSize>().setIdentity();
  F.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(dt);
  F.block<3, 3>(kPosition, kTilt) = 0.5 * dt * dt * gravity - move;
  F.block<3, 3>(kPosition, kAccelBias) = -0.5 * dt * dt * R;
  F.block<3, 3>(kVelocity, kVelocity) -= 2.0 * dt * earth;
  F.block<3, 3>(kVelocity, kTilt) = dt * gravity + move * earth;
  F.block<3, 3>(kVelocity, kGyroBias) = -(move + 0.5 * dt * dt * gravity) * R;
  F.block<3, 3>(kVelocity, kAccelBias) = -dt * R;
  F.block<3, 3>(kTilt, kTilt) -= dt * earth;
  F.block<3, 3>(kTilt, kGyroBias) = -dt * R;
  const BiasDecay decay = (-dt * bias_rate_.tail<kBiasSize>()).array().exp();

  Carry(F, decay, &P_);
  Carry(F, decay, &P0_by_dvl_);
  ErrorMatrix& A = since_.A;
  const Eigen::Matrix<double, kNavSize, kErrorSize> FA = F * A.topRows<kDrivenBy>();
  A.topRows<kNavSize>() = FA;
  A.bottomRows<kBiasSize>() = decay.asDiagonal() * A.bottomRows<kBiasSize>();
  biases_.tail<kBiasSize>().array() *= decay.array();

  for (int i = 0; i < 3; ++i) {
    P_(kPosition + i, kPosition + i) += accel_psd_ * dt * dt * dt / 3.0;
    P_(kPosition + i, kVelocity + i) += accel_psd_ * dt * dt / 2.0;
    P_(kVelocity + i, kPosition + i) += accel_psd_ * dt * dt / 2.0;
    P_(kVelocity + i, kVelocity + i) += accel_psd_ * dt;
    P_(kTilt + i, kTilt + i) += gyro_psd_ * dt;
  }
  // What turns the attitude turns the velocity with it.
  P_.block<3, 3>(kVelocity, kTilt) += gyro_psd_ * move;
  P_.block<3, 3>(kTilt, kVelocity) -= gyro_psd_ * move;
  P_.block<3, 3>(kVelocity, kVelocity) -= gyro_psd_ / dt * move * move;
  P_.diagonal().tail<kBiasSize>().array() +=
      bias_sigma_.tail<kBiasSize>().array().square() * (1.0 - decay.array().square());

  pending_s_ = 0.0;
  pending_R_.setZero();
  pending_move_.setZero();
}

void ErrorStateFilter::Coast(double dt_s,
                             const Eigen::Quaterniond& q_map_imu,
                             const InertialRates& now) {
  PropagateCovariance();
  const double sigma = params_.coast_speed_sigma_mps;
  state_.p_map += dt_s * state_.v_map_mps;
  const Eigen::Quaterniond attitude_error = QuaternionFromRotationVector(
      -(EulerAxes(state_.q_map_imu.toRotationMatrix()) * (DeviceErrorRows() * biases_)));
  state_.q_map_imu = (attitude_error * q_map_imu).normalized();
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

bool ErrorStateFilter::Offer(
    NavSensor sensor, int component, const ErrorRow& H, double residual, double variance) {
  Innovations& of_sensor = innovations_[static_cast<std::size_t>(sensor)];
  InnovationSummary& summary = of_sensor.summary;
  const double innovation = residual - H * correction_;
  const ErrorVector PH = P_ * H.transpose();
  const double S = H * PH + variance;
  const double nis = innovation * innovation / S;
  if (!(nis <= params_.gate_sigma * params_.gate_sigma)) {
    ++summary.gated;
    return false;
  }
  ++summary.used;
  const auto used = static_cast<double>(summary.used);
  summary.mean_nis += (nis - summary.mean_nis) / used;
  double& last = of_sensor.last_by_sigma[static_cast<std::size_t>(component)];
  const double by_sigma = innovation / std::sqrt(S);
  of_sensor.mean_product += (by_sigma * last - of_sensor.mean_product) / used;
  last = by_sigma;
  const double scale_step = TakeNoiseOffScale(sensor, H, PH, innovation, variance);
  const ErrorVector K = PH / S;
  correction_ += K * innovation;
  P_.noalias() -= K * PH.transpose();
  const ErrorRow HA = H * since_.A;
  since_.news += HA.transpose() * (innovation / S);
  since_.A.noalias() -= K * HA;
  // What moves the scale alone moves all else by its covariance with the scale.
  if (scale_step != 0.0)
    since_.news += since_.A.row(kDvlScale).transpose() * (scale_step / P_(kDvlScale, kDvlScale));
  return true;
}

// Marked 0: of the filter that knew the scale; error = error0 + by_scale * (error of scale). A DVL
// that reads longer is one with less noise, so S0 depends on the scale: d S0 / d scale is
// -2 H P0_by_dvl_ H^T, and at the DVL 2 H P0 H^T more. The scale that fits a motion best minimises
// the sum of innovation^2 / S0. The Kalman gain sees how it changes the innovation, not how it
// changes S0. This adds the other part, whose mean is minus that of the noise in the velocity that
// shows the scale times the noise in the innovation. Derived in docs/navigation.md.
double ErrorStateFilter::TakeNoiseOffScale(NavSensor sensor,
                                           const ErrorRow& H,
                                           const ErrorVector& PH,
                                           double innovation,
                                           double variance) {
  const double scale_variance = P_(kDvlScale, kDvlScale);
  if (scale_variance == 0.0) return 0.0;
  const bool is_dvl = sensor == NavSensor::kDvl;
  const ErrorVector by_scale = P_.col(kDvlScale) / scale_variance;
  const double innovation_by_scale = PH(kDvlScale) / scale_variance;
  const double S = H * PH + variance;
  const double S0 = S - innovation_by_scale * PH(kDvlScale);
  const ErrorVector K0 = (PH - by_scale * PH(kDvlScale)) / S0;
  const ErrorVector PH0_by_dvl = P0_by_dvl_ * H.transpose();
  const double HPH0_by_dvl = H * PH0_by_dvl;

  const double half_dS0 = (is_dvl ? S0 - variance : 0.0) - HPH0_by_dvl;
  const double scale_step = scale_variance * half_dS0 * innovation * innovation / (S * S);
  correction_ += (by_scale - K0 * innovation_by_scale) * scale_step;

  // (I - K0 H) P0_by_dvl_ (I - K0 H)^T, and at the DVL K0 variance K0^T.
  const ErrorVector less = PH0_by_dvl - 0.5 * (HPH0_by_dvl + (is_dvl ? variance : 0.0)) * K0;
  P0_by_dvl_.noalias() -= K0 * less.transpose();
  P0_by_dvl_.noalias() -= less * K0.transpose();
  return scale_step;
}

void ErrorStateFilter::Inject() {
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  state_.p_map += correction_.segment<3>(kPosition);
  const Eigen::Quaterniond turn = QuaternionFromRotationVector(correction_.segment<3>(kTilt));
  state_.v_map_mps = turn * state_.v_map_mps + correction_.segment<3>(kVelocity);
  state_.q_map_imu = (turn * state_.q_map_imu).normalized();
  biases_.tail<kBiasSize>() += correction_.tail<kBiasSize>();
  correction_.setZero();
}

int ErrorStateFilter::UpdateAttitude(const Eigen::Quaterniond& q_map_imu,
                                     const Eigen::Vector3d& sigma_rpy_rad) {
  PropagateCovariance();
  SetAttitudeBiasSigma(sigma_rpy_rad);
  const Eigen::Vector3d forward = state_.q_map_imu * Eigen::Vector3d::UnitX();
  if (forward.head<2>().norm() < kMinCosPitch) return 3;
  // Device = Exp(axes (bias + noise)) true, and true = Exp(tilt) estimate.
  const Eigen::Matrix3d to_rpy = EulerAxes(state_.q_map_imu.toRotationMatrix()).inverse();
  const Eigen::Vector3d difference =
      RotationVectorFromQuaternion(q_map_imu * state_.q_map_imu.conjugate());
  const AttitudeRows device = DeviceErrorRows();
  const Eigen::Vector3d residual = to_rpy * difference - device * biases_;
  int refused = 0;
  for (int i = 0; i < 3; ++i) {
    ErrorRow H = device.row(i);
    H.segment<3>(kTilt) = to_rpy.row(i);
    const double sigma = params_.attitude_white_rad(i);
    if (!Offer(NavSensor::kAttitude, i, H, residual(i), sigma * sigma)) ++refused;
  }
  Inject();
  return refused;
}

int ErrorStateFilter::UpdateDvl(const Eigen::Vector3d& v_dvl_mps,
                                const Eigen::Vector3d& sigma_mps) {
  PropagateCovariance();
  const Eigen::Matrix3d R_dvl_imu = mounting_.T_imu_dvl.linear().transpose();
  const Eigen::Vector3d p_imu_dvl = mounting_.T_imu_dvl.translation();
  const Eigen::Matrix3d R_dvl_map = R_dvl_imu * state_.q_map_imu.toRotationMatrix().transpose();
  // The DVL measures over ground: the Earth's own turn is not motion.
  const Eigen::Vector3d turn = rates_.angular_rate_radps - biases_.segment<3>(kGyroBias) -
                               state_.q_map_imu.conjugate() * earth_.rate_radps;
  const Eigen::Vector3d v_dvl = R_dvl_map * state_.v_map_mps + R_dvl_imu * turn.cross(p_imu_dvl);

  const double scale = 1.0 + biases_(kDvlScale);
  const Eigen::Matrix3d mounted =
      QuaternionFromRotationVector(biases_.segment<3>(kDvlMounting)).toRotationMatrix();
  const Eigen::Vector3d expected = scale * (mounted * v_dvl);
  Eigen::Matrix<double, 3, kErrorSize> H;
  H.setZero();
  H.middleCols<3>(kVelocity) = scale * mounted * R_dvl_map;
  H.middleCols<3>(kGyroBias) = scale * mounted * R_dvl_imu * Skew(p_imu_dvl);
  H.col(kDvlScale) = mounted * v_dvl;
  H.middleCols<3>(kDvlMounting) = -Skew(expected);

  int refused = 0;
  for (int i = 0; i < 3; ++i) {
    const double variance = sigma_mps(i) * sigma_mps(i);
    if (!Offer(NavSensor::kDvl, i, H.row(i), v_dvl_mps(i) - expected(i), variance)) ++refused;
  }
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
  // Both at once at the gate, then one after the other with the noise made independent.
  const Eigen::Matrix2d S = H * P_ * H.transpose() + covariance_m2;
  const double nis = residual.dot(S.llt().solve(residual));
  if (!(nis <= 2.0 * params_.gate_sigma * params_.gate_sigma)) {
    innovations_[static_cast<std::size_t>(NavSensor::kPositionFix)].summary.gated += 2;
    return 2;
  }
  const Eigen::Matrix2d L = covariance_m2.llt().matrixL();
  const Eigen::Matrix2d whiten = L.inverse();
  const Eigen::Vector2d white_residual = whiten * residual;
  const Eigen::Matrix<double, 2, kErrorSize> white_H = whiten * H;
  int refused = 0;
  for (int i = 0; i < 2; ++i)
    if (!Offer(NavSensor::kPositionFix, i, white_H.row(i), white_residual(i), 1.0)) ++refused;
  Inject();
  return refused;
}

// The step is the device's, not the vehicle's: the bias is free to take it.
void ErrorStateFilter::OpenAttitudeBias() {
  P_.diagonal().segment<3>(kAttitudeBias).array() += kPi * kPi / 4.0;
}

void ErrorStateFilter::OpenVelocity() {
  const double sigma = params_.coast_speed_sigma_mps;
  P_.diagonal().segment<3>(kVelocity).array() += sigma * sigma;
}

void ErrorStateFilter::OpenDepth() {
  P_(kPosition + 2, kPosition + 2) += params_.start_depth_sigma_m * params_.start_depth_sigma_m;
}

Eigen::Isometry3d ErrorStateFilter::T_map_vehicle() const {
  return MakePose(state_.p_map, state_.q_map_imu.toRotationMatrix()) * mounting_.T_imu_vehicle;
}

Eigen::Vector3d ErrorStateFilter::v_map_vehicle_mps() const {
  const Eigen::Vector3d turn = rates_.angular_rate_radps - biases_.segment<3>(kGyroBias);
  return state_.v_map_mps +
         state_.q_map_imu * turn.cross(Eigen::Vector3d(mounting_.T_imu_vehicle.translation()));
}

Eigen::Matrix<double, 8, kErrorSize> ErrorStateFilter::VehicleJacobian() const {
  const Eigen::Vector3d lever = state_.q_map_imu * mounting_.T_imu_vehicle.translation();
  // Roll and pitch turn about the vehicle's axes, which are not the inertial unit's.
  const Eigen::Matrix3d axes = EulerAxes(T_map_vehicle().linear());
  Eigen::Matrix<double, 8, kErrorSize> J;
  J.setZero();
  J.block<3, 3>(0, kPosition).setIdentity();
  J.block<3, 3>(0, kTilt) = -Skew(lever);
  J.block<3, 3>(3, kTilt) = axes.inverse();
  J.block<2, 2>(6, kVelocity).setIdentity();
  J.block<2, 3>(6, kTilt) = -Skew(state_.v_map_mps).topRows<2>();
  return J;
}

InnovationSummary ErrorStateFilter::innovations(NavSensor sensor) const {
  const Innovations& of_sensor = innovations_[static_cast<std::size_t>(sensor)];
  InnovationSummary summary = of_sensor.summary;
  if (summary.mean_nis > 0.0) summary.lag_one = of_sensor.mean_product / summary.mean_nis;
  return summary;
}

const ErrorMatrix& ErrorStateFilter::covariance() {
  PropagateCovariance();
  return P_;
}

ErrorStateFilter::Transition ErrorStateFilter::TakeTransition() {
  PropagateCovariance();
  return std::exchange(since_, {ErrorMatrix::Identity(), ErrorVector::Zero()});
}

}  // namespace seastitch
