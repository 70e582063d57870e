#include "mapper/health/navigation_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

namespace seastitch {
namespace {

// Longest time between two attitudes of a device of 1 Hz, with some lost [s].
constexpr double kAttitudeSilentS = 3.0;
// Share of the time in gaps of the inertial data from which on that is a fault.
constexpr double kMostInGaps = 0.1;

std::string Text(const NavSensorHealth& health) {
  char text[100];
  std::snprintf(text,
                sizeof text,
                "%.0f %% of the last minute, since %s",
                100.0 * health.refused_share,
                UtcOf(*health.refused_since).c_str());
  return text;
}

std::int64_t NumberOf(const std::map<std::string, std::int64_t>& late) {
  std::int64_t all = 0;
  for (const auto& [sensor, n] : late) all += n;
  return all;
}

std::string NamesOf(const std::map<std::string, std::int64_t>& late) {
  std::string names;
  for (const auto& [sensor, n] : late)
    names += (names.empty() ? "" : ", ") + sensor + " " + std::to_string(n);
  return names;
}

}  // namespace

void NavigationWatch::Add(const ImuSample& sample) {
  if (!first_imu_) first_imu_ = sample.time;
  newest_imu_ = sample.time;
  imu_rate_.Add(sample.time, params_.imu_gap_s);
  if (sample.attitude) last_attitude_ = sample.time;
}

void NavigationWatch::Add(const DvlSample& sample) {
  if (sample.bottom_lock) last_lock_ = sample.time;
}

void NavigationWatch::ImuRate::Add(Time t, double gap_s) {
  const double passed_s = last ? ToSeconds(t - *last) : 0.0;
  last = t;
  if (passed_s <= 0.0 || passed_s > kSilenceS) return;
  measured_s += passed_s;
  ++samples;
  if (passed_s > gap_s) in_gaps_s += passed_s;
  if (measured_s < kWindowS) return;
  share = in_gaps_s / measured_s;
  rate_hz = samples / measured_s;
  measured_s = in_gaps_s = 0.0;
  samples = 0;
}

// By the last window, or by what the open one has so far.
bool NavigationWatch::ImuRate::IsTooSlow() const {
  return share > kMostInGaps || in_gaps_s > kMostInGaps * kWindowS;
}

double NavigationWatch::ImuRate::Hz() const {
  return rate_hz > 0.0 || measured_s <= 0.0 ? rate_hz : samples / measured_s;
}

void NavigationWatch::Lasting::Look(bool holds, std::optional<Time> now) {
  if (!holds)
    since.reset();
  else if (!since)
    since = now;
}

void NavigationWatch::Lasting::AddTo(std::vector<Condition>* conditions,
                                     const ConditionKind& kind) const {
  if (since) conditions->push_back({&kind, "since " + UtcOf(*since)});
}

void NavigationWatch::Look(const Navigation& navigation) {
  if (const std::optional<Time> now = navigation.latest()) {
    const NavTally& tally = navigation.tally();
    late_.Follow(NumberOf(tally.late()), *now);
    resets_.Follow(tally.resets(), *now);
    heading_steps_.Follow(tally.heading_steps(), *now);
  }
  const NavDoubts doubts = navigation.doubts();
  gyros_doubted_.Look(doubts.gyros, navigation.latest());
  accelerometers_doubted_.Look(doubts.accelerometers, navigation.latest());
  attitude_frozen_.Look(doubts.attitude_frozen, navigation.latest());
}

std::vector<Condition> NavigationWatch::conditions(const Navigation& navigation) const {
  std::vector<Condition> now;
  const std::optional<Time> latest = navigation.latest();
  if (!latest) {
    const bool long_since =
        first_imu_ && ToSeconds(*newest_imu_ - *first_imu_) > params_.start_wait_s;
    if (long_since)
      now.push_back({&conditions::kNavigationNotStarted, Explain(navigation.start_state())});
    return now;
  }
  if (!navigation.place_is_known()) now.push_back({&conditions::kPlaceUnknown, {}});
  AddImuRate(&now);
  if (!imu_rate_.IsTooSlow()) AddDvl(navigation, &now);  // its velocities are not used in gaps
  AddRefusals(navigation, &now);
  AddDoubts(&now);
  const auto add_events = [&](const FaultEvents<Time>& events, const ConditionKind& kind) {
    if (events.Holds(*latest))
      now.push_back(
          {&kind,
           std::to_string(events.total()) + " in all, the last at " + UtcOf(*events.last())});
  };
  add_events(resets_, conditions::kNavigationReset);
  add_events(heading_steps_, conditions::kHeadingStep);
  if (late_.Holds(*latest))
    now.push_back({&conditions::kSamplesLate, NamesOf(navigation.tally().late()) + " in all"});
  AddOffsets(navigation, &now);
  return now;
}

void NavigationWatch::AddImuRate(std::vector<Condition>* now) const {
  if (!imu_rate_.IsTooSlow()) return;
  char text[120];
  std::snprintf(text,
                sizeof text,
                "%.1f samples a second, %.0f %% of the time without; needed: one in %.2g s",
                imu_rate_.Hz(),
                100.0 * imu_rate_.share,
                params_.imu_gap_s);
  now->push_back({&conditions::kImuTooSlow, text});
}

// Also in the first moments after a start, in which no ensemble has come yet.
bool NavigationWatch::SeesBottom() const {
  const std::optional<Time>& since = last_lock_ ? last_lock_ : first_imu_;
  return since && ToSeconds(*newest_imu_ - *since) <= params_.bottom_lock_timeout_s;
}

// SeesBottom() is the instrument's own bottom lock; the state's bottom_lock also needs accepted
// velocities.
void NavigationWatch::AddDvl(const Navigation& navigation, std::vector<Condition>* now) const {
  const NavSensorHealth health = navigation.health(NavSensor::kDvl);
  if (!SeesBottom()) {
    now->push_back({&conditions::kNoBottomLock, {}});
  } else if (!last_lock_) {
    return;
  } else if (health.refused_since) {
    now->push_back({&conditions::kDvlRefused, Text(health)});
  } else if (const auto state = navigation.StateAt(*navigation.latest());
             state && !state->bottom_lock) {
    now->push_back({&conditions::kDvlRefused, "none was used for some seconds"});
  }
}

void NavigationWatch::AddRefusals(const Navigation& navigation, std::vector<Condition>* now) const {
  const auto add = [&](NavSensor sensor, const ConditionKind& kind) {
    const NavSensorHealth health = navigation.health(sensor);
    if (health.refused_since) now->push_back({&kind, Text(health)});
  };
  add(NavSensor::kAttitude, conditions::kAttitudeRefused);
  add(NavSensor::kDepth, conditions::kDepthRefused);
  add(NavSensor::kPositionFix, conditions::kFixesRefused);
}

void NavigationWatch::AddDoubts(std::vector<Condition>* now) const {
  gyros_doubted_.AddTo(now, conditions::kGyroDoubted);
  accelerometers_doubted_.AddTo(now, conditions::kAccelerometerDoubted);
  attitude_frozen_.AddTo(now, conditions::kAttitudeFrozen);
  if (last_attitude_ && ToSeconds(*newest_imu_ - *last_attitude_) > kAttitudeSilentS)
    now->push_back({&conditions::kAttitudeSilent, "since " + UtcOf(*last_attitude_)});
}

void NavigationWatch::AddOffsets(const Navigation& navigation, std::vector<Condition>* now) const {
  std::string all;
  for (const SuspectedOffset& offset : navigation.suspected_offsets()) {
    const bool is_dvl = offset.sensor == NavSensor::kDvl;
    const double configured_s = is_dvl ? params_.dvl_time_offset_s : params_.attitude_time_offset_s;
    char text[160];
    std::snprintf(text,
                  sizeof text,
                  "%sset navigation.%s_time_offset_s to %.3f (1 sigma %.3f s%s)",
                  all.empty() ? "" : ", ",
                  is_dvl ? "dvl" : "attitude",
                  configured_s + offset.add_s,
                  offset.sigma_s,
                  offset.add_s > 0.0 ? "; early stamps are not corrected meanwhile" : "");
    all += text;
  }
  if (!all.empty()) now->push_back({&conditions::kTimeOffsetSuspected, all});
}

}  // namespace seastitch
