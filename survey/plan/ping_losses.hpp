#pragma once

#include <cstdint>
#include <string>

#include "common/core/counters.hpp"

namespace seastitch {

// How many pings of survey files are in the map, one line: "1873 of 1873 pings used". Below 90 % it
// is a warning with the reasons. mapper: the mapper's counters.
struct PingLosses {
  PingLosses(std::int64_t pings, const Counters& mapper);

  bool is_warning = false;
  std::string text;
};

}  // namespace seastitch
