#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

// Variance components of a survey: four figures for the errors by which two overlapping submaps
// differ. The defaults are the prior, for a survey without overlaps yet.
// docs/noise-from-overlaps.md.
struct VarianceComponents {
  // White noise of a sounding: its variance divided by the variance of the soundings about the
  // smooth seabed (scatter).
  double sounding_variance_ratio = 1.0;
  // Correlated height errors of neighbouring soundings (roll bias, sound speed, heave), 1 sigma
  // divided by the altitude. Their correlation is exp(-distance / kErrorCorrelationLengthM). The
  // middle of what surveys estimate of themselves, 0.00023 to 0.0006; a roll bias of 0.023 deg, at
  // 45 deg.
  double correlated_error_ratio = 0.0004;
  // Random walk of the position inside a submap, from its frame on [m/sqrt(m)]: the white noise of
  // a DVL of 1 cm/s at 5 Hz and 1.5 m/s is 0.0037.
  double position_walk = 0.002;
  // Random walk of the heading inside a submap [rad/sqrt(m)].
  double heading_walk = Deg2Rad(0.0115);
};

// Fixed, since overlaps cannot determine it: the likelihood increases up to the longest value that
// was tried, which is wider than an overlap.
constexpr double kErrorCorrelationLengthM = 100.0;

}  // namespace seastitch
