#include "mapper/navigation/filter/error_state_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/attitude_math.hpp"

namespace seastitch {
namespace {

// navigation states and the two inertial biases, on which they depend
constexpr int kDrivenBy = 15;
// Step of the error's covariance [s]: the error changes more slowly than the state, so that this
// may be longer than the step of the strapdown.
constexpr double kCovarianceStepS = 0.05;
// Ratio of stated sigmas beyond which a change is followed.
constexpr double kStatedSigmaFalls = 0.5;
// Random walk of an unmeasured velocity [m/s/sqrt(s)].
constexpr double kHeldVelocityNoise = 0.3;
// Density of the noise with rounding: uniform with a variance of step^2 / 12, correlated over
// correlation_s.
double WithRounding(double density, double step, double correlation_s) {
  return density * density + step * step / 12.0 * 2.0 * correlation_s;
}

// F differs from the identity only in its first nine rows, and on the diagonal of the biases.
using NavRows = Eigen::Matrix<double, kNavSize, kDrivenBy>;
using BiasDecay = Eigen::Matrix<double, kBiasSize, 1>;

// Computes P = F P F^T.
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
}

// The device states one sigma for all parts of its heading error: what exceeds the other parts is
// taken as the constant part.
void ErrorStateFilter::SetAttitudeBiasSigma(const Eigen::Vector3d& sigma_rpy_rad) {
  Eigen::Vector3d floor;
  floor << params_.attitude_roll_pitch_rad.sigma, params_.attitude_heading_rad.sigma;
  const double wander = params_.attitude_heading_wander_rad.sigma;
  const double deviation = params_.attitude_deviation_rad;
  const double stated = sigma_rpy_rad.z();
  const double stays2 = stated * stated - wander * wander - deviation * deviation;
  const Eigen::Vector3d stated_rpy(
      sigma_rpy_rad.x(), sigma_rpy_rad.y(), std::sqrt(std::max(stays2, 0.0)));
  const Eigen::Vector3d sigma = stated_rpy.cwiseMax(floor);
  for (int axis = 0; axis < 3; ++axis) FollowStatedSigma(axis, sigma(axis));
}

// Follows the sigma that the device states. A sigma smaller than ever before means that the device
// has estimated its error by a filter of its own: the bias shrinks accordingly. A larger sigma
// means that the device lost this for a time; the error it had at its best remains.
void ErrorStateFilter::FollowStatedSigma(int axis, double sigma) {
  const int i = kAttitudeBias + axis;
  double& least = least_attitude_sigma_(axis);
  if (sigma <= kStatedSigmaFalls * least) {
    ShrinkBias(i, least, sigma);
    least = sigma;
  }
  bias_sigma_(i) = least;
  const bool lost = sigma * kStatedSigmaFalls >= least;
  if (axis == 2) return LoseHeading(lost ? std::sqrt(sigma * sigma - least * least) : 0.0);
  // For roll and pitch the accelerometers are the better reference: the added error may decay with
  // its own time constant.
  if (!lost) return;
  bias_sigma_(i) = sigma;
  P_(i, i) = std::max(P_(i, i), sigma * sigma);
}

// Adds the lost part to the wandering error of the heading, not to the constant one.
void ErrorStateFilter::LoseHeading(double lost_rad) {
  const GaussMarkov<double>& wander = params_.attitude_heading_wander_rad;
  const double sigma = Hypotenuse(wander.sigma, lost_rad);
  double& held = bias_sigma_(kHeadingWander);
  const bool less = sigma <= kStatedSigmaFalls * held;
  const bool more = sigma * kStatedSigmaFalls >= held;
  if (sigma == held || (!less && !more)) return;
  if (less)
    ShrinkBias(kHeadingWander, held, sigma);
  else
    P_(kHeadingWander, kHeadingWander) += sigma * sigma - held * held;
  held = sigma;
  bias_rate_(kHeadingWander) =
      1.0 / (lost_rad > wander.sigma ? params_.attitude_heading_rad.tau_s : wander.tau_s);
}

// Shrinks a bias whose sigma fell from `before` to `after` by estimation inside the device.
void ErrorStateFilter::ShrinkBias(int i, double before, double after) {
  const double keep = after * after / (before * before);
  ErrorMatrix M = ErrorMatrix::Identity();
  M(i, i) = keep;
  Apply(M);
  P_(i, i) += after * after * (1.0 - keep);
  biases_(i) *= keep;
}

AttitudeRows ErrorStateFilter::DeviceErrorRows() const {
  const double yaw = RpyFromRotation(state_.q_map_imu.toRotationMatrix()).z();
  AttitudeRows rows = AttitudeRows::Zero();
  rows.middleCols<3>(kAttitudeBias).setIdentity();
  rows(2, kHeadingWander) = 1.0;
  rows(2, kDeviation) = std::sin(yaw);
  rows(2, kDeviation + 1) = std::cos(yaw);
  rows(2, kHeadingDoubt) = -doubt_rad_;
  return rows;
}

// The device's attitude without the step of its heading that the filter does not follow.
Eigen::Quaterniond ErrorStateFilter::WithoutStep(const Eigen::Quaterniond& q_map_imu) const {
  const Eigen::AngleAxisd back(-heading_offset_rad_, Eigen::Vector3d::UnitZ());
  return Eigen::Quaterniond(back) * q_map_imu;
}

void ErrorStateFilter::Initialise(const Start& start,
                                  const Eigen::Quaterniond& q_map_imu,
                                  const Eigen::Vector3d& sigma_rpy_rad) {
  state_ = {start.p_map_imu, start.v_map_mps, q_map_imu.normalized()};
  biases_.setZero();
  heading_offset_rad_ = doubt_rad_ = 0.0;
  least_attitude_sigma_.setConstant(std::numeric_limits<double>::infinity());
  P_.setZero();
  SetAttitudeBiasSigma(sigma_rpy_rad);
  P_.diagonal() = bias_sigma_.cwiseAbs2();
  P_.diagonal().segment<3>(kPosition) = start.sigma_p_m.cwiseAbs2();
  P_.diagonal().segment<3>(kVelocity).setConstant(start.sigma_v_mps * start.sigma_v_mps);
  AlignWithDevice();
  P0_by_dvl_.setZero();
  since_ = {ErrorMatrix::Identity(), ErrorVector::Zero()};
  stamp_error_ = {};
  pending_s_ = 0.0;
  pending_R_.setZero();
  pending_move_.setZero();
}

double ErrorStateFilter::GyroBiasSigma() const {
  return std::sqrt(P_.diagonal().segment<3>(kGyroBias).maxCoeff());
}

InertialRates ErrorStateFilter::WithoutBias(const InertialRates& measured) const {
  return {measured.angular_rate_radps - biases_.segment<3>(kGyroBias),
          measured.specific_force_mps2 - biases_.segment<3>(kAccelBias)};
}

void ErrorStateFilter::Propagate(const InertialRates& from, const InertialRates& to, double dt_s) {
  if (velocity_is_held_) PropagateCovariance();
  velocity_is_held_ = false;
  Step(from, to, dt_s);
}

void ErrorStateFilter::PropagateHoldingVelocity(const InertialRates& from,
                                                const InertialRates& to,
                                                double dt_s) {
  if (!velocity_is_held_) PropagateCovariance();
  velocity_is_held_ = true;
  InertialRates held_from = from;
  InertialRates held_to = to;
  held_from.specific_force_mps2 = ForceThatHolds(from.angular_rate_radps);
  held_to.specific_force_mps2 = ForceThatHolds(to.angular_rate_radps);
  Step(held_from, held_to, dt_s);
}

void ErrorStateFilter::AddErrorOfRates(const Eigen::Vector3d& turn_rad,
                                       const Eigen::Vector3d& push_mps) {
  PropagateCovariance();
  const Eigen::Matrix3d R = state_.q_map_imu.toRotationMatrix();
  const auto in_map = [&R](const Eigen::Vector3d& sigma) -> Eigen::Matrix3d {
    return R * sigma.cwiseAbs2().asDiagonal() * R.transpose();
  };
  P_.block<3, 3>(kTilt, kTilt) += in_map(turn_rad);
  P_.block<3, 3>(kVelocity, kVelocity) += in_map(push_mps);
}

// Specific force that keeps the velocity along the vehicle's own axes, as the accelerometers would
// measure it.
Eigen::Vector3d ErrorStateFilter::ForceThatHolds(const Eigen::Vector3d& rate_radps) const {
  const Eigen::Quaterniond to_body = state_.q_map_imu.conjugate();
  const Eigen::Vector3d v_body = to_body * state_.v_map_mps;
  const Eigen::Vector3d turn = rate_radps - biases_.segment<3>(kGyroBias);
  return turn.cross(v_body) +
         to_body * (earth_.rate_radps.cross(state_.v_map_mps) - earth_.gravity_mps2) +
         biases_.segment<3>(kAccelBias);
}

void ErrorStateFilter::Step(const InertialRates& from, const InertialRates& to, double dt_s) {
  pending_R_ += dt_s * state_.q_map_imu.toRotationMatrix();
  pending_s_ += dt_s;
  const Eigen::Vector3d from_p = state_.p_map;
  state_ = Integrate(state_, WithoutBias(from), WithoutBias(to), dt_s, earth_);
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
  if (velocity_is_held_) {
    // The velocity is constant in the vehicle's axes, whatever the tilt, and independent of the
    // accelerometers.
    F.block<3, 3>(kPosition, kTilt) = -move;
    F.block<3, 3>(kPosition, kAccelBias).setZero();
    F.middleRows<3>(kVelocity).setZero();
    F.block<3, 3>(kVelocity, kVelocity).setIdentity();
  }
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
  for (ErrorVector* by : {&stamp_error_.by_delay, &stamp_error_.by_carrying}) {
    by->head<kNavSize>() = (F * by->head<kDrivenBy>()).eval();
    by->tail<kBiasSize>().array() *= decay.array();
  }

  const double accel_psd = velocity_is_held_ ? kHeldVelocityNoise * kHeldVelocityNoise : accel_psd_;
  for (int i = 0; i < 3; ++i) {
    P_(kPosition + i, kPosition + i) += accel_psd * dt * dt * dt / 3.0;
    P_(kPosition + i, kVelocity + i) += accel_psd * dt * dt / 2.0;
    P_(kVelocity + i, kPosition + i) += accel_psd * dt * dt / 2.0;
    P_(kVelocity + i, kVelocity + i) += accel_psd * dt;
    P_(kTilt + i, kTilt + i) += gyro_psd_ * dt;
  }
  if (!velocity_is_held_) {
    // Noise of the gyros rotates attitude and velocity together.
    P_.block<3, 3>(kVelocity, kTilt) += gyro_psd_ * move;
    P_.block<3, 3>(kTilt, kVelocity) -= gyro_psd_ * move;
    P_.block<3, 3>(kVelocity, kVelocity) -= gyro_psd_ / dt * move * move;
  }
  P_.diagonal().tail<kBiasSize>().array() +=
      bias_sigma_.tail<kBiasSize>().array().square() * (1.0 - decay.array().square());

  if (doubt_rad_ != 0.0) RotateDisplacementByHeadingDoubt();
  pending_s_ = 0.0;
  pending_R_.setZero();
  pending_move_.setZero();
}

// Derivative of the error state by the hypothesis: the error if the other heading is right.
ErrorVector ErrorStateFilter::ByHeadingDoubt() const {
  if (doubt_rad_ == 0.0) return ErrorVector::Zero();
  return P_.col(kHeadingDoubt) / P_(kHeadingDoubt, kHeadingDoubt);
}

bool ErrorStateFilter::Offer(NavSensor sensor,
                             int component,
                             const ErrorRow& H,
                             double residual,
                             double variance,
                             double change_per_s,
                             double carried_s) {
  const double innovation = residual - H * correction_;
  const double S = H * P_ * H.transpose() + variance;
  if (!(innovation * innovation <= params_.gate_sigma * params_.gate_sigma * S)) {
    ++innovations_[static_cast<std::size_t>(sensor)].summary.gated;
    return false;
  }
  Use(sensor, component, H, residual, variance, change_per_s, carried_s);
  return true;
}

void ErrorStateFilter::Use(NavSensor sensor,
                           int component,
                           const ErrorRow& H,
                           double residual,
                           double variance,
                           double change_per_s,
                           double carried_s) {
  Innovations& of_sensor = innovations_[static_cast<std::size_t>(sensor)];
  InnovationSummary& summary = of_sensor.summary;
  const double innovation = residual - H * correction_;
  const ErrorVector PH = P_ * H.transpose();
  const double S = H * PH + variance;
  const double nis = innovation * innovation / S;
  ++summary.used;
  const auto used = static_cast<double>(summary.used);
  summary.mean_nis += (nis - summary.mean_nis) / used;
  double& last = of_sensor.last_by_sigma[static_cast<std::size_t>(component)];
  const double by_sigma = innovation / std::sqrt(S);
  of_sensor.mean_product += (by_sigma * last - of_sensor.mean_product) / used;
  last = by_sigma;
  const bool estimates_slow = estimates_slow_ && estimates_inertial_;
  const double scale_step =
      estimates_slow ? TakeNoiseOffScale(sensor, H, PH, innovation, variance) : 0.0;
  // The gain under the filter's own hypothesis of the heading: a mean of both would be wrong under
  // either.
  const ErrorVector by_doubt = ByHeadingDoubt();
  const double PH_doubt = PH(kHeadingDoubt);
  const double S_own = S - H.dot(by_doubt) * PH_doubt;
  ErrorVector K = (PH - by_doubt * PH_doubt) / S_own;
  if (!estimates_slow) K.segment<4>(kDvlScale).setZero();
  if (!estimates_inertial_) K.segment<6>(kGyroBias).setZero();
  // Schmidt's considered states: excluded from the gain, they keep their values, and their
  // uncertainty counts.
  if (estimates_slow && doubt_rad_ == 0.0)
    P_.noalias() -= K * PH.transpose();
  else
    P_.noalias() -= K * PH.transpose() + PH * K.transpose() - S * K * K.transpose();
  correction_ += K * innovation;
  // Derivative of the residual by the delay of the stamps: minus the rate of change of the reading.
  StampError& stamps = stamp_error_;
  stamps.by_delay -= K * (H.dot(stamps.by_delay) - change_per_s);
  stamps.by_carrying -= K * (H.dot(stamps.by_carrying) - carried_s * change_per_s);
  const ErrorRow HA = H * since_.A;
  since_.adjoint += HA.transpose() * (innovation / S_own);
  since_.A.noalias() -= K * HA;
  // A correction of the scale corrects all other states by their covariance with the scale.
  if (scale_step != 0.0)
    since_.adjoint += since_.A.row(kDvlScale).transpose() * (scale_step / P_(kDvlScale, kDvlScale));
}

// Values marked 0 belong to a filter that knows the scale: error = error0 + by_scale * (error of
// scale). A DVL with a larger scale has less relative noise, so that S0 depends on the scale: d S0
// / d scale is -2 H P0_by_dvl_ H^T, and for the DVL additionally 2 H P0 H^T. The maximum-likelihood
// scale minimises the sum of innovation^2 / S0. The Kalman gain includes the dependence of the
// innovation on the scale, but not that of S0. This function adds the second part. Its mean is
// minus the mean product of the noise in the velocity from which the scale is estimated and the
// noise in the innovation. Derived in docs/navigation.md.
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

  // (I - K0 H) P0_by_dvl_ (I - K0 H)^T, plus K0 variance K0^T for the DVL.
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
  // Roll and pitch are angles about the vehicle's axes, not the inertial unit's.
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

const ErrorStateFilter::StampError& ErrorStateFilter::stamp_error() {
  PropagateCovariance();
  return stamp_error_;
}

ErrorStateFilter::Transition ErrorStateFilter::TakeTransition() {
  PropagateCovariance();
  return std::exchange(since_, {ErrorMatrix::Identity(), ErrorVector::Zero()});
}

}  // namespace seastitch
