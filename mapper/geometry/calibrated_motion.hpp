#pragma once

#include <optional>

#include "common/core/calibration.hpp"
#include "common/core/time.hpp"
#include "mapper/geometry/georeference.hpp"

namespace seastitch {

// Depth of the vehicle less its mean of the last 20 s: heave. A first-order high pass, whose phase
// is 3 degrees early for waves of 6 s. Begins at zero, and again after a gap of a minute. Pure.
class HeaveFilter {
 public:
  // z_m: of the vehicle in the map, down. Times rise; an earlier one gives the last heave again.
  double Add(Time t, double z_m);

 private:
  std::optional<Time> last_;
  double mean_m_ = 0.0;
  double heave_m_ = 0.0;
};

// Pose of the vehicle for the sonar: what the lookup states, with the calibration's corrections of
// attitude and depth. heave_m: of the HeaveFilter, for the whole ping.
PoseLookup CalibratedPoses(PoseLookup T_map_vehicle_at,
                           const SonarCalibration& calibration,
                           double heave_m);

// How much later than a ping's last echo a calibration needs a pose; never negative.
Duration LooksAhead(const SonarCalibration& calibration);

SwathCorrection SwathCorrectionOf(const SonarCalibration& calibration);

}  // namespace seastitch
