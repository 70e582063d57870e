#pragma once

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

}  // namespace seastitch
