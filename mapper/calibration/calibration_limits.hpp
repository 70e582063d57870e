#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "common/core/calibration.hpp"

namespace seastitch {

// Largest size of each value that a sonar or its navigation can have, in the unit of mapper.yaml,
// which takes no larger one.
inline constexpr std::array<double, kCalibrationKeys> kLargestCalibration{
    10.0,   // roll_deg
    10.0,   // second_head_roll_deg
    50.0,   // smile_mps
    50.0,   // smile_by_water_mps
    500.0,  // attitude_latency_ms
    500.0,  // depth_latency_ms
    20.0,   // roll_scale_percent
    50.0,   // heave_scale_percent
};

// Whether each value that an estimate would add is one that a sonar can have. Where one is not, the
// heights of overlaps differ for another reason, and the other values are of no use either.
inline bool IsPossible(const CalibrationEstimate& estimate) {
  return std::all_of(
      kCalibrationNames.begin(), kCalibrationNames.end(), [&](const CalibrationName& of) {
        const double largest = kLargestCalibration[static_cast<std::size_t>(of.key)] * of.per_unit;
        return std::abs(estimate.Of(of.key).add) <= largest;
      });
}

}  // namespace seastitch
