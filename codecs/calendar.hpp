#pragma once

#include <cstdint>
#include <optional>

#include "common/core/time.hpp"

namespace seastitch {

// Midnight of a day, 1970 to 2199; nothing for a day that is none.
std::optional<Time> Midnight(int year, int month, int day);
// day_of_year from 1.
std::optional<Time> MidnightOfYearDay(int year, int day_of_year);

// The instant at that time of day which is nearest to another one.
Time NearestTimeOfDay(Duration time_of_day, Time near);

}  // namespace seastitch
