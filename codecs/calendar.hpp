#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Midnight UTC of a day, 1970 to 2199; absent for a day that does not exist.
std::optional<Time> Midnight(int year, int month, int day);
// The same by day of the year, counted from 1.
std::optional<Time> MidnightOfYearDay(int year, int day_of_year);

// The instant with this time of day that is nearest to another instant.
Time NearestTimeOfDay(Duration time_of_day, Time near);

// Seconds of the GPS week, less or more by whole weeks: those nearest to another time. So a week
// that ends inside a file goes on.
double WeekSecondsNear(double week_s, double near_s);

// Largest difference between a sensor's stamp and that of the datagram that has it.
constexpr Duration kMaxStampError = std::chrono::minutes(1);

inline bool AreNear(Time a, Time b) { return std::chrono::abs(a - b) <= kMaxStampError; }

// A sensor's stamp in a datagram with a stamp of its own. A GNSS receiver whose 10-bit count of
// weeks has overflowed is 1024 weeks late: these are added. Absent for any other difference beyond
// kMaxStampError.
std::optional<Time> SensorTime(Time stamp, Time datagram);

}  // namespace seastitch
