#include "codecs/calendar.hpp"

#include <chrono>
#include <cmath>

namespace seastitch {
namespace {

constexpr Duration kDay = std::chrono::hours(24);

bool IsYear(int year) { return year >= 1970 && year < 2200; }

Time ToTime(std::chrono::sys_days day) {
  return Time(std::chrono::duration_cast<Duration>(day.time_since_epoch()));
}

}  // namespace

std::optional<Time> Midnight(int year, int month, int day) {
  if (!IsYear(year) || month < 1 || day < 1 || day > 31) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  return date.ok() ? std::optional(ToTime(date)) : std::nullopt;
}

std::optional<Time> MidnightOfYearDay(int year, int day_of_year) {
  if (!IsYear(year) || day_of_year < 1 || day_of_year > 366) return std::nullopt;
  return ToTime(std::chrono::sys_days(std::chrono::year(year) / 1 / 1) +
                std::chrono::days(day_of_year - 1));
}

Time NearestTimeOfDay(Duration time_of_day, Time near) {
  const Duration off = near.time_since_epoch() - time_of_day;
  const auto days = std::chrono::floor<std::chrono::days>(off + kDay / 2);
  return Time(days + time_of_day);
}

double WeekSecondsNear(double week_s, double near_s) {
  return week_s + kGpsWeekS * std::round((near_s - week_s) / kGpsWeekS);
}

std::optional<Time> SensorTime(Time stamp, Time datagram) {
  constexpr Duration kOverflow = std::chrono::weeks(1024);
  for (const Duration late : {Duration::zero(), kOverflow})
    if (AreNear(stamp + late, datagram)) return stamp + late;
  return std::nullopt;
}

}  // namespace seastitch
