#pragma once

#include <algorithm>
#include <cmath>

// A receiver's R in Kongsberg's installation parameters is not the roll of roll-pitch-heading: it
// is the inclination of the array's across axis against the horizontal, which the installer
// measures. After a roll r and a pitch p that axis, (0, cos r, sin r) turned by p, goes down by cos
// p sin r:
//   sin R = cos p sin r.
// (A transmitter's P is the inclination of its along axis, which does not depend on roll.)
namespace seastitch {

inline double RollOfReceiver(double inclination_rad, double pitch_rad) {
  const double sine = std::sin(inclination_rad) / std::cos(pitch_rad);
  return std::abs(inclination_rad) > std::acos(0.0)  // mounted upside down
             ? inclination_rad
             : std::asin(std::clamp(sine, -1.0, 1.0));
}

inline double InclinationOfReceiver(double roll_rad, double pitch_rad) {
  return std::abs(roll_rad) > std::acos(0.0) ? roll_rad
                                             : std::asin(std::sin(roll_rad) * std::cos(pitch_rad));
}

}  // namespace seastitch
