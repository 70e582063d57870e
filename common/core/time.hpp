#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

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

// Begin of GPS time, which has no leap seconds: 6 January 1980; and the length of its week.
inline constexpr Time kGpsEpoch = FromUtime(315'964'800'000'000);
inline constexpr double kGpsWeekS = 604'800.0;

// Rounds to the nearest microsecond.
constexpr Duration FromSeconds(double s) {
  return Duration(static_cast<std::int64_t>(s * 1e6 + (s < 0 ? -0.5 : 0.5)));
}

// Date and time, UTC, whole seconds: %Y, %m, %d, %H, %M and %S of the format are replaced.
inline std::string UtcText(Time t, std::string_view format = "%Y-%m-%dT%H:%M:%SZ") {
  const std::chrono::sys_time<Duration> utc(t.time_since_epoch());
  const auto day = std::chrono::floor<std::chrono::days>(utc);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss time(std::chrono::floor<std::chrono::seconds>(utc - day));
  std::string text;
  const auto add = [&text](int digits, auto value) {
    std::string number = std::to_string(value);
    text.append(static_cast<std::size_t>(std::max(0, digits - static_cast<int>(number.size()))),
                '0');
    text += number;
  };
  for (std::size_t i = 0; i < format.size(); ++i) {
    switch (format[i] == '%' && i + 1 < format.size() ? format[++i] : '\0') {
      case 'Y': add(4, static_cast<int>(date.year())); break;
      case 'm': add(2, static_cast<unsigned>(date.month())); break;
      case 'd': add(2, static_cast<unsigned>(date.day())); break;
      case 'H': add(2, time.hours().count()); break;
      case 'M': add(2, time.minutes().count()); break;
      case 'S': add(2, time.seconds().count()); break;
      default: text += format[i];
    }
  }
  return text;
}

// Time of day, such as "12:34:56 UTC".
inline std::string UtcOf(Time t) { return UtcText(t, "%H:%M:%S UTC"); }

}  // namespace seastitch
