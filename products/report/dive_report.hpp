#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/calibration.hpp"
#include "common/core/survey_noise.hpp"
#include "products/survey.hpp"

// Results of one dive's replay, for the report.
namespace seastitch {

// Difference between the track of a second navigation and that of the map, without the difference
// of their first positions.
struct NavigationDifference {
  std::string source;             // of the second one, as in `navigation_source`
  std::uint64_t states = 0;       // compared
  double duration_s = 0.0;        // from the first to the last of them
  double rms_m = 0.0;             // horizontal
  double max_m = 0.0;             // horizontal
  double heading_mean_deg = 0.0;  // second minus first
};

// Compares two tracks by rising time where the second has a state within a second before and after.
// Absent where there is none.
std::optional<NavigationDifference> CompareNavigations(const std::vector<TrackState>& track,
                                                       const std::vector<TrackState>& second,
                                                       const std::string& source);

struct DiveReport {
  std::map<std::string, std::int64_t> counters;  // of the dive's mapper
  std::vector<std::string> conditions;           // conditions of HEALTH at the end, as sentences
  SonarTimingEstimate sonar;
  std::vector<StampOffsetEstimate> stamp_offsets;
  std::optional<NavigationDifference> other_navigation;
  // Angle of the Doppler log beyond its yaw in vehicle.yaml, where it is clearly wrong.
  std::optional<double> dvl_turned_rad{};
  // What the overlaps say of the sonar's calibration, one a round: the last is of this map. Empty:
  // not estimated.
  std::vector<CalibrationEstimate> calibration{};
  // Whether overlaps tell of the calibration what single lines could only suggest.
  bool IsSeenByOverlaps() const { return !calibration.empty() && calibration.front().HasEnough(); }
};

// A dive of several whose input was not read, or not to its end.
struct UnreadDive {
  std::string name;
  std::string reason;
};

}  // namespace seastitch
