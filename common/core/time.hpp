#pragma once

#include <chrono>
#include <cstdint>

namespace seastitch {

// Instant of a measurement: UTC, microseconds since the Unix epoch, as carried in every utime
// field.
struct UtcMicros {
  using rep = std::int64_t;
  using period = std::micro;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<UtcMicros>;
  static constexpr bool is_steady = false;  // no now(): cores get the time from messages
};

using Time = UtcMicros::time_point;
using Duration = UtcMicros::duration;

constexpr Time FromUtime(std::int64_t utime_us) { return Time(Duration(utime_us)); }
constexpr std::int64_t ToUtime(Time t) { return t.time_since_epoch().count(); }
constexpr double ToSeconds(Duration d) { return std::chrono::duration<double>(d).count(); }

// Rounds to the nearest microsecond.
constexpr Duration FromSeconds(double s) {
  return Duration(static_cast<std::int64_t>(s * 1e6 + (s < 0 ? -0.5 : 0.5)));
}

}  // namespace seastitch
