#pragma once

#include <cstdint>
#include <string>

#include "mapper/submaps/losses.hpp"

namespace seastitch {

// How many pings of survey files are in the map, one line: "1873 of 1873 pings used". Below 99 % it
// is a warning with the reasons. too_far: positions that are too far from the map's origin.
struct PingLosses {
  PingLosses(std::int64_t pings, const PingTally& tally, std::int64_t too_far);

  bool is_warning = false;
  std::string text;
};

}  // namespace seastitch
