#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/health/counters.hpp"
#include "survey/plan/survey_plan.hpp"
#include "survey/read/sbet_beside.hpp"

namespace seastitch {

// Contents of the heads of a survey's files. Navigation is counted by source
// (NavigationRecord::source), without the sources that cover much less of the pings than the best.
// Sources of navigation beside the files are all kept: they are there on purpose.
struct Census {
  Counters positions, velocities, attitudes, levels, headings, heaves, depths;
  // IsOfPings(), not among the attitudes: all beside raw pings, else those without roll and pitch.
  Counters attitudes_of_pings;
  Counters still_heaves;  // sources whose heave is always 0
  // First position of each source. One that is far from most others of the source is left out.
  std::map<std::string, GeoPosition> start;
  std::map<std::string, Eigen::Vector2d> grid_start;
  std::optional<SonarInstallation> installation;
  std::int64_t raw_pings = 0;
  std::int64_t placed_pings = 0;
  std::int64_t placed_with_depth = 0;
  std::int64_t profiles = 0;  // of sound speed
  // Of the raw pings; without any, of the placed ones.
  double depth_m = 0.0;          // median
  double max_range_m = 0.0;      // largest
  double ping_interval_s = 0.0;  // median
  Counters not_read;  // of the readers: records by the reason for which they were not read
};

// Reads the heads of the files but soundings by line, and completes their description. Throws
// DataError naming the file that cannot be used.
Census TakeCensus(std::vector<PlannedFile>* files);

// The same of the soundings by line alone, whose parameters are known.
Census TakeLineCensus(std::vector<PlannedFile>* files);
// Adds soundings by line, which are used where there are no others.
void AddLines(const Census& lines, Census* census);

// Source of headings that the pings of a sonar state, for want of an attitude.
inline constexpr char kHeadingOfPings[] = "em_ping";

// True if the records of this source state the pose of each ping for soundings that the sonar has
// placed. Their attitude is too sparse for travel times and angles.
bool IsOfPings(const std::string& source);

}  // namespace seastitch
