#pragma once

#include <optional>
#include <vector>

#include "common/core/sensors.hpp"

namespace seastitch {

struct ProfileRow {
  double depth_m = 0.0;
  double speed_mps = 0.0;
};

// A profile from the rows of a file, in the order of the cast. Rows of an impossible sound speed
// are left out; where the cast begins deeper than it ends, it is read backwards; rows that are then
// not deeper than those before are left out. Absent where a number is not finite, or no row is
// left.
std::optional<SoundVelocityProfile> ProfileFrom(Time time, std::vector<ProfileRow> rows);

}  // namespace seastitch
