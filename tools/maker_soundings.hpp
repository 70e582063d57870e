#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "tools/survey_plan.hpp"

namespace seastitch {

// Soundings that a replay computes from raw times and angles, less those that the sonar's software
// has ray traced from the same pings.
struct SoundingComparison {
  int pings = 0;
  int beams = 0;
  // Forward, starboard, down: root mean square, percent of the depth below the water line.
  Eigen::Vector3d rms_percent = Eigen::Vector3d::Zero();
};

// Compares the first max_pings pings of a survey. Without raw pings, soundings, profile or poses
// nothing is compared.
SoundingComparison CompareWithMaker(const SurveyPlan& plan, int max_pings);

// The plan of a survey, with the sound speed that agrees better with the sonar's own soundings
// (SurveyPlan::profile_alone). Throws DataError naming the file that cannot be used.
SurveyPlan PlanSurvey(const std::vector<std::filesystem::path>& files);

}  // namespace seastitch
