#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/median.hpp"
#include "mapper/input/sensor_clocks.hpp"

// What HEALTH is told of the clocks.
namespace seastitch {
namespace {

constexpr double kFixesHoldS = 60.0;  // their clock is judged so long after one
constexpr double kSilentS = 2.0;
constexpr double kSilentIntervals = 2.5;
constexpr double kDriftS = 0.2;

}  // namespace

// A sensor of before a restart is silent once the process has waited for it.
bool SensorClocks::IsSilent(const Channel& c) const {
  if (!c.health_time_s && health_time_s() < kSilentS) return false;
  return ToSeconds(*newest() - c.segment.ReceivedAt()) >
         std::max(kSilentS, kSilentIntervals * c.interval_s());
}

std::vector<Condition> SensorClocks::conditions() const {
  std::vector<Condition> all;
  const std::optional<Time> at = newest();
  if (last_step_at_ && ToSeconds(*at - *last_step_at_) < conditions::kClockStep.events.holds_s)
    all.push_back({&conditions::kClockStep, last_step_ + " at " + UtcOf(*last_step_at_)});
  AddSilent(&all);
  AddSilentProcesses(&all);
  AddDrifts(&all);
  AddFixClock(&all);
  return all;
}

void SensorClocks::AddSilent(std::vector<Condition>* all) const {
  std::string names;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    const Channel& c = channels_[i];
    if (!c.has_come || IsRare(i) || !IsSilent(c)) continue;
    char text[60];
    std::snprintf(text,
                  sizeof text,
                  "%s%s since %s",
                  names.empty() ? "" : ", ",
                  NameOf(static_cast<SensorChannel>(i)),
                  UtcOf(c.segment.At()).c_str());
    names += text;
  }
  if (!names.empty()) all->push_back({&conditions::kSensorSilent, names});
}

void SensorClocks::AddSilentProcesses(std::vector<Condition>* all) const {
  std::string names;
  for (const std::string& name : processes_.silent()) names += (names.empty() ? "" : ", ") + name;
  if (!names.empty()) all->push_back({&conditions::kProcessSilent, names});
}

void SensorClocks::AddDrifts(std::vector<Condition>* all) const {
  std::vector<double> drifts_s;
  for (const Channel& c : channels_)
    if (c.latency.first_s) drifts_s.push_back(c.latency.drift_s());
  if (drifts_s.size() < 2 || !IsRealTime()) return;
  // Of two drifts the smaller one is the common drift.
  std::sort(drifts_s.begin(), drifts_s.end(), [](double a, double b) {
    return std::abs(a) < std::abs(b);
  });
  const double common_s = drifts_s[(drifts_s.size() - 1) / 2];
  std::string names;
  for (std::size_t i = 0; i < kSensorChannels; ++i) {
    const double drift_s = channels_[i].latency.drift_s();
    if (!channels_[i].latency.first_s || std::abs(drift_s) <= kDriftS ||
        std::abs(drift_s - common_s) <= kDriftS)
      continue;
    char text[80];
    std::snprintf(text,
                  sizeof text,
                  "%s%s has come to lag by %.2f s",
                  names.empty() ? "" : ", ",
                  NameOf(static_cast<SensorChannel>(i)),
                  drift_s);
    names += text;
  }
  if (!names.empty()) all->push_back({&conditions::kClockDrift, names});
}

// Fixes come at any time, but those of one source take about as long on the way.
void SensorClocks::AddFixClock(std::vector<Condition>* all) const {
  const Channel& fixes = Of(SensorChannel::kPositionFix);
  const std::optional<double> fix_s = fixes.lateness_s();
  if (!fix_s || !IsRealTime() || ToSeconds(*newest() - fixes.segment.ReceivedAt()) > kFixesHoldS)
    return;
  std::vector<double> others_s;
  for (std::size_t i = 0; i < kSensorChannels; ++i)
    if (!IsRare(i) && channels_[i].lateness_s()) others_s.push_back(*channels_[i].lateness_s());
  if (others_s.empty()) return;
  const double late_s = *fix_s - Median(others_s);
  if (std::abs(late_s) <= kFixLatencyS) return;
  char text[60];
  std::snprintf(
      text, sizeof text, "%.1f s %s", std::abs(late_s), late_s > 0.0 ? "behind" : "ahead");
  all->push_back({&conditions::kFixClock, text});
}

}  // namespace seastitch
