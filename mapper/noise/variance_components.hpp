#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

// The errors that two overlapping submaps differ by, in four figures of the survey. As they stand
// here: the prior, where nothing is known of a survey yet. docs/noise-from-overlaps.md.
struct VarianceComponents {
  // White noise of a sounding: its variance over the scatter of the soundings about the smooth
  // seabed.
  double sounding_variance_ratio = 1.0;
  // Errors of height that neighbouring soundings share (roll bias, sound speed, heave), 1 sigma
  // over the altitude; their correlation falls as exp(-distance / kErrorCorrelationLengthM). What
  // calibration leaves of a roll bias, 0.017 deg, is 0.0003 of the altitude at 45 deg.
  double correlated_error_ratio = 0.0003;
  // Random walk of the position inside a submap, from its frame on [m/sqrt(m)]: the white noise of
  // a DVL of 1 cm/s at 5 Hz and 1.5 m/s is 0.0037.
  double position_walk = 0.002;
  // The same of the heading [rad/sqrt(m)].
  double heading_walk = Deg2Rad(0.0115);
};

// Overlaps show no more of this length than that it is long: the likelihood rises to the longest
// that was tried, which is wider than an overlap.
constexpr double kErrorCorrelationLengthM = 100.0;

}  // namespace seastitch
