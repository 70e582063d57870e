#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"

namespace seastitch::test {

// Error of the horizontal position against the truth, less that of the first state.
struct TrackScore {
  double rms_m = 0.0;
  double largest_m = 0.0;
};

struct FilterScore : TrackScore {
  double sigma_m = 0.0;        // stated at the end, of the horizontal distance
  double nees = 0.0;           // of north and east, mean over the dive, divided by 2
  double worst_nees = 0.0;     // the same, of the worst second
  double relative_nees = 0.0;  // of x, y, yaw between frames 30 s apart, mean, divided by 3
  // From the end of the fault until velocity, tilt and heading are within 3 stated sigma and stay
  // there for 10 s. Nothing: never, or no state.
  std::optional<double> recovery_s;
  double largest_speed_mps = 0.0;  // of any state given
  std::map<std::string, std::int64_t> counters;
  std::vector<SuspectedOffset> offsets;
};

// Feeds all samples in order of time, each when it was measured.
void FeedDive(const Dive& dive, DeadReckoning* navigation);

// error^T covariance^-1 error of x, y, yaw of the pose at the second row of truth as seen from the
// first. Nothing where navigation has no state.
std::optional<double> RelativeNees(const TruthSample& from,
                                   const TruthSample& to,
                                   const DeadReckoning& navigation);

// Dead reckoning of the dive. fault_end_s: from the dive's first sample; below 0: no fault ends.
FilterScore ScoreFilter(const Dive& dive, double fault_end_s);

// What needs no filter: the device's attitude times the DVL's velocity, with the same stamps and
// mounting, nothing gated; over gaps the last velocity holds, and the last attitude.
TrackScore ScoreBaseline(const Dive& dive);

}  // namespace seastitch::test
