#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/mapper/navigation/fault_dives.hpp"

namespace seastitch::test {

// One thing that is wrong with a dive's sensors.
struct FaultCase {
  std::string name;
  std::function<void(Dive*)> apply;
  // Where the wrong samples lie, in seconds from the dive's first sample. from_s < 0: all along.
  double from_s = -1.0;
  double to_s = -1.0;
  // Nobody can see these unaided: held against the same filter without the wrong samples.
  bool unseen = false;
  // For those: takes the wrong samples out of the dive.
  std::function<void(Dive*)> tell = {};
};

// Attitude, DVL stamped so much later than they were measured.
FaultCase LateAttitude(double delay_s);
FaultCase LateDvl(double delay_s);
FaultCase AttitudeEvery(double interval_s);
// The device's heading is off from from_s to to_s.
FaultCase HeadingStep(double degrees, double from_s, double to_s);
// Body velocity halved and 0.6 m/s more to starboard, bottom lock up.
FaultCase WrongVelocities(double from_s, double duration_s);
enum class StuckSensor { kGyro, kAccelerometer, kAttitude };
FaultCase Stuck(StuckSensor sensor, double from_s, double duration_s);
FaultCase InertialGap(double from_s, double duration_s);

// All cases of the benchmark.
std::vector<FaultCase> FaultCases();

}  // namespace seastitch::test
