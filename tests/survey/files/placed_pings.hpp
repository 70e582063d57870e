#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "codecs/survey_reader.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

namespace seastitch {

struct PlacedSoundings {
  Time time;
  std::vector<Eigen::Vector3d> p_map_m;
};

// What navigation and geometry of the mapper make of files.
struct PlacedSurvey {
  std::string text;  // of the plan
  Counters counters;
  double datum_latitude_deg = 0.0;
  double datum_longitude_deg = 0.0;
  std::vector<PlacedSoundings> pings;  // those of which the place is known
};

// Throws what planning the survey throws, and DataError with the reason of a survey that cannot be
// mapped.
PlacedSurvey PlaceSurvey(const std::vector<std::filesystem::path>& files);

}  // namespace seastitch
