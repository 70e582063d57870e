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

// The plan of a survey that agrees best with the sonar's own soundings: with the sound speed at the
// transducer or without (SurveyPlan::profile_alone), and if soundings from raw times and angles
// are more than 1 % of depth off, with the depth that the sonar states for each ping, or with the
// sonar's own soundings (SurveyPlan::warning). mounting_is_given: without an installation in the
// files, that of a vehicle.yaml applies, so that nothing follows from a difference. Throws
// DataError naming the file that cannot be used.
SurveyPlan PlanSurvey(const std::vector<std::filesystem::path>& files,
                      bool mounting_is_given = false);

}  // namespace seastitch
