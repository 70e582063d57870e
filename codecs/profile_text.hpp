#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/sensors.hpp"

namespace seastitch {

// A cast of a sound speed probe, from a file of text.
struct ProfileCast {
  std::optional<Time> time;      // absent: not stated
  SoundVelocityProfile profile;  // its time is that of the cast; Time() where it is not stated
};

// Casts of a text, and why there are none or fewer than it begins, for people.
struct ProfileText {
  std::vector<ProfileCast> casts;
  std::string problem;  // empty: all of it was read
};

// Reads Kongsberg's ASVP ("( SoundVelocity 1.0 0 201505211456 ... )", then depth and speed), CARIS
// SVP ("[SVP_VERSION_2]", then sections, each with a day of the year and rows of depth and speed),
// and two columns of depth [m] and sound speed [m/s] without a header, separated by blanks, commas
// or semicolons; where it is no comma, a comma may stand for the point. Times are UTC. Further
// columns, lines before the first row of two columns and lines that begin with # are not read.
ProfileText ParseProfileText(std::string_view text);

}  // namespace seastitch
