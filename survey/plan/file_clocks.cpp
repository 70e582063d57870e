#include "survey/plan/file_clocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kLeastOffsetS = 0.9;
// The next ping comes up to so much later than the record.
constexpr double kLeastByPingsS = 0.7;
constexpr double kWholeS = 0.03;
// Most of a file lies within this of its median, or the offset is not one of the whole file.
constexpr double kConstantS = 0.1;
constexpr double kConstantByPingsS = 1.0;
// A record is written at once, or up to so much later.
constexpr double kWrittenLateS = 1.5;
// Pings far apart show an offset no better than this.
constexpr double kAsPositionsS = 5.0;
constexpr std::size_t kFewest = 3;
constexpr std::size_t kMost = 100'000;  // values kept of a source

bool IsLarge(double offset_s, double least_s) { return std::abs(offset_s) >= least_s; }

// The median, if nine tenths of the values are within `constant_s` of it.
std::optional<double> Constant(const std::vector<double>& values, double constant_s) {
  if (values.empty()) return std::nullopt;
  const double median = Median(values);
  const auto near = std::count_if(
      values.begin(), values.end(), [&](double v) { return std::abs(v - median) <= constant_s; });
  return 10 * static_cast<std::size_t>(near) >= 9 * values.size() ? std::optional(median)
                                                                  : std::nullopt;
}

// Kongsberg's files have these records where they came.
bool IsWrittenAsItComes(const std::string& source) {
  for (const char* const begin : {"#SKM", "#SPO", "A", "n", "P"})
    if (source.starts_with(begin) && source.size() == std::string_view(begin).size() + 1)
      return true;
  return false;
}

void AddTo(std::vector<double>* values, double value) {
  if (values->size() < kMost) values->push_back(value);
}

}  // namespace

void FileClocks::Add(const NavigationRecord& record) {
  Source& source = sources_[record.source];
  source.last = record.time;
  if (!record.position) return;
  source.of = ClockOffset::Of::kPosition;
  if (record.arrival) AddTo(&source.by_arrival_s, ToSeconds(record.time - *record.arrival));
  const double step_s = source.place ? ToSeconds(record.time - source.place->time) : 0.0;
  if (source.place && step_s > 0.0 && step_s < 60.0) {
    if (step_s < 1.0) return;
    source.distance_m += DistanceM(*record.position, *source.place->position);
    source.time_s += step_s;
  }
  source.place = record;
}

void FileClocks::Add(const ClockComparison& clock) {
  Source& source = sources_[clock.source];
  source.of = ClockOffset::Of::kClock;
  AddTo(&source.by_arrival_s, ToSeconds(clock.external_time - clock.time));
}

// A record was written after the ping before it and before the ping after it. Both have been
// written when their echoes had come.
void FileClocks::AddPing(Time time, double travel_time_s) {
  const std::optional<Time> before = std::exchange(ping_, time);
  for (auto& [name, source] : sources_) {
    const std::optional<Time> last = std::exchange(source.last, std::nullopt);
    if (!last || !before || *before > time || !IsWrittenAsItComes(name)) continue;
    const double latest_s = ToSeconds(*last - *before),
                 earliest_s = ToSeconds(*last - time) - travel_time_s;
    // Zero, if it may be: a sample is written at once or up to kWrittenLateS later.
    const double off_s = earliest_s > 0.0 ? earliest_s : std::min(0.0, latest_s + kWrittenLateS);
    AddTo(&source.by_pings_s, off_s);
  }
}

std::map<std::string, ClockOffset> FileClocks::Finish() {
  std::map<std::string, ClockOffset> off;
  std::optional<double> moved_s;
  double speed_mps = 0.0;
  for (const auto& [name, source] : sources_) {
    if (source.time_s > 0.0) speed_mps = std::max(speed_mps, source.distance_m / source.time_s);
    const auto ahead_s = Constant(source.by_arrival_s, kConstantS);
    if (!ahead_s || !IsLarge(*ahead_s, kLeastOffsetS)) continue;
    const double whole_s = std::round(*ahead_s);
    const bool is_whole = std::abs(*ahead_s - whole_s) <= kWholeS;
    const bool is_clock = source.of == ClockOffset::Of::kClock;
    // What a position shows of itself goes before what a clock shows of others.
    if (is_whole && !(is_clock && moved_s)) moved_s = whole_s;
    off[name] = {.ahead_s = is_whole ? whole_s : *ahead_s,
                 .is_moved = is_whole && !is_clock,
                 .of = source.of};
  }
  for (const auto& [name, source] : sources_) {
    if (!source.by_arrival_s.empty() || source.by_pings_s.size() < (moved_s ? 1 : kFewest))
      continue;
    const auto ahead_s = Constant(source.by_pings_s, kConstantByPingsS);
    if (!ahead_s || !IsLarge(*ahead_s, kLeastByPingsS)) continue;
    const bool as_positions = moved_s && std::abs(*ahead_s - *moved_s) < kAsPositionsS;
    off[name] = {
        .ahead_s = as_positions ? *moved_s : *ahead_s, .is_moved = as_positions, .of = source.of};
  }
  // A clock is told of where no sensor is known to go by it.
  std::erase_if(off, [&off](const auto& clock) {
    return clock.second.of == ClockOffset::Of::kClock && off.size() > 1;
  });
  for (auto& [name, clock] : off)
    if (clock.of != ClockOffset::Of::kClock) clock.speed_mps = speed_mps;
  sources_.clear();
  ping_.reset();
  return off;
}

std::optional<double> EffectOf(const ClockOffset& clock) {
  if (clock.speed_mps <= 0.0) return std::nullopt;
  return clock.speed_mps * std::abs(clock.ahead_s);
}

std::string ClockText(const std::string& source, const ClockOffset& clock) {
  const double off_s = std::abs(clock.ahead_s);
  const char* what = "attitude (%s) is stamped";
  switch (clock.of) {
    case ClockOffset::Of::kAttitude: break;
    case ClockOffset::Of::kPosition: what = "positions (%s) are stamped"; break;
    case ClockOffset::Of::kClock: what = "the clock that sets the sonar's (%s) is"; break;
  }
  char subject[100], text[400];
  std::snprintf(subject, sizeof subject, what, source.c_str());
  std::snprintf(text,
                sizeof text,
                "%s %s%.*f s %s the sonar's clock%s",
                subject,
                clock.is_moved ? "" : "about ",
                clock.is_moved ? 0 : 1,
                off_s,
                clock.ahead_s > 0.0 ? "ahead of" : "behind",
                off_s > 15.5 && off_s < 18.5 ? " (GPS time in place of UTC?)" : "");
  std::string effect;
  if (const std::optional<double> effect_m = EffectOf(clock))
    effect = ", which is " + std::to_string(std::lround(*effect_m)) + " m of the vehicle's way";
  return text + effect +
         (clock.is_moved ? "; moved onto it"
                         : "; not corrected: check how the sensor and the sonar were synchronised");
}

}  // namespace seastitch
