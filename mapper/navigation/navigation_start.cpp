#include "mapper/navigation/navigation_start.hpp"

#include <utility>

#include "common/core/pose.hpp"
#include "mapper/navigation/filter/strapdown.hpp"

namespace seastitch {
namespace {

// Oldest measurement that is used for the start [s].
constexpr double kFreshS = 2.0;
// Two attitudes within this time (1 Hz with some jitter) that differ by no more than the vehicle
// can turn are taken as valid, not as stray values.
constexpr double kSteadyAttitudeS = 1.5;
constexpr double kSteadyAttitudeRad = 0.1;
constexpr double kMaxTurnRadps = 0.6;

template <class T>
bool IsFresh(const std::optional<Stamped<T>>& last, Time t) {
  return last && ToSeconds(t - last->time) <= kFreshS;
}

}  // namespace

std::string Explain(StartState state) {
  switch (state) {
    case StartState::kNoInertialData: return "no usable inertial samples";
    case StartState::kNoAttitude:
      return "the inertial unit sends no usable attitude: enable its attitude output";
    case StartState::kAttitudeUnsteady:
      return "the attitude jumps from sample to sample, or comes less than once in 1.5 s";
    case StartState::kHeadingTooCoarse:
      return "the attitude sensor is aligning, or its heading sigma is above "
             "navigation.start_heading_sigma_deg";
    case StartState::kNoDepthOrVelocity:
      return "no depth or no bottom lock yet: waiting for navigation.start_wait_s";
    case StartState::kNoFix:
      return "no position fix yet: navigation.start_at_first_fix waits for one";
    case StartState::kNoGivenAttitude: return "no attitude on INS";
    case StartState::kNoGivenPosition: return "no position on INS, or no attitude with it";
    case StartState::kNoGivenDepth: return "no depth on INS or DEPTH";
    case StartState::kStarted: return "";
  }
  return "";
}

void NavigationStart::Use(Time t, const AttitudeEvent& attitude) {
  const double dt_s = attitude_ ? ToSeconds(t - attitude_->time) : kSteadyAttitudeS + 1.0;
  const bool steady =
      dt_s <= kSteadyAttitudeS && attitude_->value.q_map_imu.angularDistance(attitude.q_map_imu) <
                                      kSteadyAttitudeRad + kMaxTurnRadps * dt_s;
  if (!steady) steady_since_.reset();
  if (steady && !steady_since_) steady_since_ = attitude_->time;
  attitude_ = {t, attitude};
  attitude_is_new_ = true;
}

void NavigationStart::Use(Time t, const FixEvent& fix) {
  if (!fix_ || t >= fix_->time) fix_ = {t, fix};
}

double NavigationStart::MovedSinceFix(Time t) const {
  return ToSeconds(t - fix_->time) * params_.start_speed_sigma_mps;
}

StartState NavigationStart::StateAt(Time t) const {
  if (!IsFresh(attitude_, t)) return StartState::kNoAttitude;
  if (!steady_since_) return StartState::kAttitudeUnsteady;
  if (attitude_->value.alignment == HeadingAlignment::kAligning ||
      attitude_->value.sigma_rpy_rad.z() > params_.start_heading_sigma_rad)
    return StartState::kHeadingTooCoarse;
  const bool waits = ToSeconds(t - *steady_since_) < params_.start_wait_s;
  const bool aided = IsFresh(dvl_, t) && IsFresh(depth_, t);
  if (!aided && waits) return StartState::kNoDepthOrVelocity;
  if (params_.start_at_first_fix && !HasFix(t) && waits) return StartState::kNoFix;
  return StartState::kStarted;
}

std::optional<NavigationStart::First> NavigationStart::Try(Time t, const InertialRates& rates) {
  const bool is_new = std::exchange(attitude_is_new_, false);
  const StartState state = StateAt(t);
  if (state == StartState::kStarted && !is_new) return std::nullopt;
  state_ = state;
  if (state != StartState::kStarted) return std::nullopt;
  First first;
  first.attitude = attitude_->value;
  // The gyros carry the attitude from its own time to the start.
  const Eigen::Quaterniond turn =
      QuaternionFromRotationVector(rates.angular_rate_radps * ToSeconds(t - attitude_->time));
  first.attitude.q_map_imu = (first.attitude.q_map_imu * turn).normalized();
  Place(t, &first);
  const Eigen::Matrix3d R = first.attitude.q_map_imu.toRotationMatrix();
  first.start.sigma_v_mps = params_.start_speed_sigma_mps;
  if (IsFresh(dvl_, t)) {
    const Eigen::Isometry3d& T_imu_dvl = mounting_.T_imu_dvl;
    const Eigen::Vector3d swing =
        rates.angular_rate_radps.cross(Eigen::Vector3d(T_imu_dvl.translation()));
    first.start.v_map_mps = R * (T_imu_dvl.linear() * dvl_->value.v_dvl_mps - swing);
    first.dvl = dvl_->time;
  }
  return first;
}

void NavigationStart::Place(Time t, First* first) const {
  const Eigen::Matrix3d R = first->attitude.q_map_imu.toRotationMatrix();
  Eigen::Vector3d p_map_vehicle = Eigen::Vector3d::Zero();
  if (!params_.start_at_first_fix)
    p_map_vehicle.head<2>() << params_.start_north_m, params_.start_east_m;
  ErrorStateFilter::Start& start = first->start;
  first->place_is_known = !params_.start_at_first_fix || HasFix(t);
  start.sigma_p_m.setConstant(first->place_is_known ? params_.start_sigma_m : kUnknownPlaceM);
  if (params_.start_at_first_fix && HasFix(t)) {
    const double moved_m = MovedSinceFix(t);
    const Eigen::Vector2d variance = fix_->value.covariance_m2.diagonal();
    const Eigen::Matrix3d R_map_vehicle = R * mounting_.T_imu_vehicle.linear();
    p_map_vehicle.head<2>() = fix_->value.OfVehicle(R_map_vehicle).north_east_m;
    start.sigma_p_m.head<2>() = (variance.array() + moved_m * moved_m).sqrt();
  }
  start.p_map_imu = p_map_vehicle - R * mounting_.T_imu_vehicle.translation();
  start.sigma_p_m.z() = params_.start_depth_sigma_m;  // until the first depth after the start
  first->has_depth = IsFresh(depth_, t);
  if (first->has_depth)
    start.p_map_imu.z() = depth_->value.depth_m - (R * mounting_.p_imu_depth).z();
}

}  // namespace seastitch
