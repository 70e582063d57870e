#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "survey/plan/survey_plan.hpp"

namespace seastitch {

// A sounding that a replay computes from raw times and angles, less the one that the sonar's
// software has ray traced from the same beam.
struct SoundingResidual {
  double angle_rad;  // of the sounding from the vertical under the vehicle; negative: to port
  Eigen::Vector3d percent_of_depth;  // forward, starboard, down; of the depth below the water line
};

struct SoundingComparison {
  int pings = 0;
  std::vector<SoundingResidual> residuals;

  int beams() const { return static_cast<int>(residuals.size()); }
  // Root mean square over the beams of these angles; zero without any.
  Eigen::Vector3d RmsPercent(double from_deg = -90.0, double to_deg = 90.0) const;
};

// Position of the vehicle between a ping's time and its last echo: as navigation has it, or held at
// the ping's time, as the makers' software does.
enum class PositionInPing : std::uint8_t { kMoves, kHeld };

// Compares the first max_pings pings of a survey. Without raw pings, soundings, profile or poses
// nothing is compared.
SoundingComparison CompareWithMaker(const SurveyPlan& plan,
                                    int max_pings,
                                    PositionInPing position = PositionInPing::kMoves);

// The plan of a survey that agrees best with the sonar's own soundings: with the sound speed at the
// transducer or without (SurveyPlan::profile_alone), and if soundings from raw times and angles
// are more than 1 % of depth off, with the depth that the sonar states for each ping, or with the
// sonar's own soundings (SurveyPlan::warning). mounting_is_given: without an installation in the
// files, that of a vehicle.yaml applies, so that nothing follows from a difference. Throws
// DataError naming the file that cannot be used.
SurveyPlan PlanSurvey(const std::vector<std::filesystem::path>& files,
                      bool mounting_is_given = false,
                      const ProfileChoice& profiles = {});

}  // namespace seastitch
