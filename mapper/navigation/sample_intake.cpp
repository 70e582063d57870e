#include "mapper/navigation/sample_intake.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

// Inertial stamps beyond clock_jump_s are followed after clock_jump_samples, or after so long.
constexpr double kLeapLastsS = 0.3;
constexpr int kFewestAfterLeap = 3;

// Limits of plausible measurements.
constexpr double kMaxRateRadps = 35.0;  // above the range of SBG ECAN
constexpr double kMaxForceMps2 = 200.0;
constexpr double kMaxSpeedMps = 20.0;
constexpr double kMaxSpeedSigmaMps = 10.0;
constexpr double kMinDepthM = -20.0;
constexpr double kMaxDepthM = 12000.0;
constexpr double kMaxDepthSigmaM = 1000.0;
constexpr double kMaxFixVarianceM2 = 1e8;
constexpr double kMaxFixDistanceM = 100e3;  // from the datum, because the map is flat
// Largest time by which a sensor may be ahead of the inertial unit [s].
constexpr double kMaxAheadS = 5.0;
// The same for fixes, which the graph can use inside a gap of the inertial data.
constexpr double kMaxFixAheadS = 60.0;
constexpr std::size_t kMaxWaiting = 20000;
constexpr std::size_t kMostBeforeImu = 2000;  // the newest ones by time

template <class M>
bool Within(const M& values, double limit) {
  return (values.array().abs() <= limit).all();  // this way round NaN is refused
}

std::string NameOf(const Event& event) {
  struct Name {
    const char* operator()(const ImuEvent&) const { return "imu"; }
    const char* operator()(const AttitudeEvent&) const { return "attitude"; }
    const char* operator()(const DvlEvent&) const { return "dvl"; }
    const char* operator()(const DepthEvent&) const { return "depth"; }
    const char* operator()(const FixEvent&) const { return "fix"; }
    const char* operator()(const SoundSpeedEvent&) const { return "sound_speed"; }
    const char* operator()(const UnusableEvent&) const { return "unusable"; }
  };
  return std::visit(Name{}, event.measurement);
}

// Time for which samples wait for late ones [s]. A negative time offset makes a sample earlier, so
// that the others wait longer.
double WaitS(const NavigationParams& params) {
  return params.reorder_window_s +
         std::max({0.0, -params.attitude_time_offset_s, -params.dvl_time_offset_s});
}

}  // namespace

SampleIntake::SampleIntake(const NavigationParams& params,
                           const VehicleGeometry& vehicle,
                           NavTally* tally)
    : params_(params),
      vehicle_(vehicle),
      map_frame_(DatumOf(vehicle)),
      wait_s_(WaitS(params)),
      tally_(tally) {}

void SampleIntake::Add(const ImuSample& sample) {
  const ImuEvent imu{{sample.angular_rate_radps, sample.specific_force_mps2}};
  const bool possible = Within(imu.rates.angular_rate_radps, kMaxRateRadps) &&
                        Within(imu.rates.specific_force_mps2, kMaxForceMps2);
  if (!possible) return Count("imu_refused");
  if (!TakesTime(sample.time)) return;
  if (!Insert({sample.time, imu})) return;
  if (!newest_imu_) LeaveOut(sample.time);
  newest_imu_ = newest_imu_ ? std::max(*newest_imu_, sample.time) : sample.time;
  if (sample.attitude) AddAttitude(sample.time, *sample.attitude, sample.alignment);
  due_ = *newest_imu_ - FromSeconds(wait_s_);
}

void SampleIntake::AddAttitude(Time t, const Attitude& attitude, HeadingAlignment alignment) {
  const bool usable = std::abs(attitude.q_ned_imu.norm() - 1.0) < 1e-2 &&
                      Within(attitude.sigma_rpy_rad, kPi) &&
                      (attitude.sigma_rpy_rad.array() >= 0.0).all();
  const Time measured = t + FromSeconds(params_.attitude_time_offset_s);
  if (!usable) return Refuse(NavSensor::kAttitude, measured, "attitude_refused");
  const Eigen::AngleAxisd to_true_north(DeclinationAt(params_, t), Eigen::Vector3d::UnitZ());
  AddAiding(
      "attitude",
      measured,
      AttitudeEvent{
          (to_true_north * attitude.q_ned_imu).normalized(), attitude.sigma_rpy_rad, alignment});
}

void SampleIntake::Refuse(NavSensor sensor, Time t, const std::string& counter) {
  Count(counter);
  const bool in_time = newest_imu_ && !IsLate(t) && t <= *newest_imu_ + FromSeconds(kMaxAheadS);
  if (in_time) Insert({t, UnusableEvent{sensor}});
}

// Decides whether an inertial sample is used. The inertial unit is the clock: a single wild stamp
// must not move it.
bool SampleIntake::TakesTime(Time t) {
  if (!newest_imu_) return true;
  const bool late = IsLate(t);
  const bool leaps = t > *newest_imu_ + FromSeconds(params_.clock_jump_s);
  if (!late && !leaps) {
    leap_.reset();
    return true;
  }
  if (late)
    tally_->CountLate("imu");
  else
    tally_->CountAhead("imu");
  const bool goes_on = leap_ && t > *leap_ && t <= *leap_ + FromSeconds(params_.clock_jump_s);
  leap_samples_ = goes_on ? leap_samples_ + 1 : 1;
  if (!goes_on) leap_began_ = t;
  leap_ = t;
  // So many samples of a slow unit would cost seconds.
  const bool has_lasted =
      leap_samples_ >= kFewestAfterLeap && ToSeconds(t - leap_began_) >= kLeapLastsS;
  if (leap_samples_ < params_.clock_jump_samples && !has_lasted) return false;
  // Forward, it is a gap in the data. Backward, it can only be accepted while no state has been
  // published.
  if (late && frozen_) return false;
  Count("clock_jump");
  if (late) {
    waiting_.clear();
    settled_.reset();
    due_.reset();
    newest_imu_.reset();
  }
  leap_.reset();
  return true;
}

void SampleIntake::Add(const DvlSample& sample) {
  if (!sample.bottom_lock) return Count("dvl_without_bottom_lock");
  const bool possible = Within(sample.v_dvl_mps, kMaxSpeedMps) &&
                        Within(sample.sigma_v_mps, kMaxSpeedSigmaMps) &&
                        (sample.sigma_v_mps.array() >= 0.0).all();
  const Time measured = sample.time + FromSeconds(params_.dvl_time_offset_s);
  if (!possible) return Refuse(NavSensor::kDvl, measured, "dvl_refused");
  if (sample.error_velocity_mps &&
      !(std::abs(*sample.error_velocity_mps) <= params_.dvl_max_error_velocity_mps))
    return Refuse(NavSensor::kDvl, measured, "dvl_error_velocity");
  DvlEvent dvl{sample.v_dvl_mps, sample.sigma_v_mps};
  for (double& sigma : dvl.sigma_mps)
    sigma = sigma > 0.0 ? std::max(sigma, params_.dvl_sigma_floor_mps) : params_.dvl_sigma_mps;
  AddAiding("dvl", measured, dvl);
}

void SampleIntake::Add(const DepthSample& sample) {
  const bool possible = sample.depth_m >= kMinDepthM && sample.depth_m <= kMaxDepthM &&
                        sample.sigma_m >= 0.0 && sample.sigma_m <= kMaxDepthSigmaM;
  if (!possible) return Refuse(NavSensor::kDepth, sample.time, "depth_refused");
  const double sigma = sample.sigma_m > 0.0 ? std::max(sample.sigma_m, params_.depth_sigma_floor_m)
                                            : params_.depth_sigma_m;
  AddAiding("depth", sample.time, DepthEvent{sample.depth_m, sigma});
}

std::optional<Event> SampleIntake::Add(const PositionFix& fix) {
  const Eigen::Matrix2d& C = fix.covariance_north_east_m2;
  const bool possible = std::abs(fix.latitude_rad) <= kPi / 2.0 &&
                        std::abs(fix.longitude_rad) <= kPi && Within(C, kMaxFixVarianceM2) &&
                        C(0, 0) > 0.0 && C.determinant() > 0.0 &&
                        std::abs(C(0, 1) - C(1, 0)) <= 1e-9 * C.trace();
  if (!possible) {
    Refuse(NavSensor::kPositionFix, fix.time, "fix_refused");
    return std::nullopt;
  }
  const Eigen::Vector2d north_east = map_frame_.NorthEastOf(fix);
  if (!Within(north_east, kMaxFixDistanceM)) {
    Refuse(NavSensor::kPositionFix, fix.time, "fix_refused");
    return std::nullopt;
  }
  const FixEvent event{north_east, C, fix.source, vehicle_.FixPointOf(fix.source)};
  if (IsLate(fix.time)) return Event{fix.time, event};
  AddAiding("fix", fix.time, event);
  return std::nullopt;
}

void SampleIntake::AddSoundSpeed(Time t, double speed_mps) {
  if (params_.dvl_sound_speed_mps == 0.0) return;
  if (!IsSoundSpeed(speed_mps)) return Count("sound_speed_refused");
  AddAiding("sound_speed", t, SoundSpeedEvent{speed_mps});
}

// Drops samples from before the first inertial sample by their time only, not by their order of
// arrival.
void SampleIntake::LeaveOut(Time first_imu) {
  const auto is_inertial = [](const Event& event) {
    return std::holds_alternative<ImuEvent>(event.measurement);
  };
  while (waiting_.front().time <= first_imu - FromSeconds(wait_s_)) {
    if (!is_inertial(waiting_.front())) Count(NameOf(waiting_.front()) + "_before_imu");
    waiting_.pop_front();
  }
  while (waiting_.back().time > first_imu + FromSeconds(kMaxAheadS)) {
    if (!is_inertial(waiting_.back())) tally_->CountAhead(NameOf(waiting_.back()));
    waiting_.pop_back();
  }
}

void SampleIntake::AddAiding(const std::string& sensor, Time t, Measurement measurement) {
  if (!newest_imu_) {
    if (waiting_.size() >= kMostBeforeImu) {
      Count(NameOf(waiting_.front()) + "_before_imu");
      waiting_.pop_front();
    }
    Insert({t, std::move(measurement)});
    return;
  }
  if (IsLate(t)) return tally_->CountLate(sensor);
  const bool is_fix = std::holds_alternative<FixEvent>(measurement);
  if (t > *newest_imu_ + FromSeconds(is_fix ? kMaxFixAheadS : kMaxAheadS))
    return tally_->CountAhead(sensor);
  Insert({t, std::move(measurement)});
}

bool SampleIntake::Insert(Event event) {
  if (waiting_.size() >= kMaxWaiting) {
    Count("queue_full");
    return false;
  }
  const auto at = std::upper_bound(waiting_.begin(), waiting_.end(), event);
  const bool is_imu = std::holds_alternative<ImuEvent>(event.measurement);
  if (is_imu && at != waiting_.begin() && std::prev(at)->time == event.time &&
      std::holds_alternative<ImuEvent>(std::prev(at)->measurement)) {
    Count("imu_duplicate");
    return false;
  }
  waiting_.insert(at, std::move(event));
  return true;
}

std::optional<Event> SampleIntake::Next() {
  if (!due_) return std::nullopt;
  if (!waiting_.empty() && waiting_.front().time <= *due_) {
    Event event = std::move(waiting_.front());
    waiting_.pop_front();
    return event;
  }
  settled_ = settled_ ? std::max(*settled_, *due_) : *due_;
  due_.reset();
  return std::nullopt;
}

void SampleIntake::Finish() { due_ = newest_imu_; }

}  // namespace seastitch
