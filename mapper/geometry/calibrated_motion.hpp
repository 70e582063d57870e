#pragma once

#include <cstdint>
#include <vector>

#include "common/core/calibration.hpp"
#include "common/core/time.hpp"
#include "mapper/geometry/georeference.hpp"

namespace seastitch {

// Depth of the vehicle at a time [m, down].
struct DepthAt {
  Time time;
  double z_m;
};

// Heave at t: the depth there less the straight line through the depths of the 20 s around t [m,
// down]. track: by rising time. Zero with fewer than three depths.
double HeaveAt(const std::vector<DepthAt>& track, Time t);
// The same by poses, ten times a second; those that the lookup does not have are left out.
double HeaveAt(const PoseLookup& T_map_vehicle_at, Time t);

// Pose of the vehicle for the sonar: what the lookup states, with the calibration's corrections of
// attitude and depth. head: of the ping. heave_m: HeaveAt() the ping.
PoseLookup CalibratedPoses(PoseLookup T_map_vehicle_at,
                           const SonarCalibration& calibration,
                           std::uint8_t head,
                           double heave_m);

// How much later than a ping's last echo a calibration needs a pose; never negative.
Duration LooksAhead(const SonarCalibration& calibration);

SwathCorrection SwathCorrectionOf(const SonarCalibration& calibration);

}  // namespace seastitch
