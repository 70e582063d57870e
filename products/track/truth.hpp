#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "products/survey.hpp"
#include "products/track/track.hpp"

namespace seastitch {

// Ground truth of the vehicle's reference point at one time, map frame.
struct TruthState {
  Time time;
  Pose2 T_map_level;
};

// Reads a file with ground truth: the header line
// "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg", then one line per state of the vehicle. Time
// is Unix time (UTC) and strictly rising; poses are in the map frame (docs/frames.md). z, roll and
// pitch are checked and not used. Throws std::runtime_error "FILE:LINE: reason" at the first line
// that is anything else.
std::vector<TruthState> ReadTruth(const std::filesystem::path& path);

// Horizontal position and heading error along a track.
struct TrackError {
  double position_rms_m = 0.0;
  double position_max_m = 0.0;
  double position_end_m = 0.0;  // at the last state compared
  // 99.9 % of the changes of the position error within a second: steps of the track.
  double position_change_m = 0.0;
  double yaw_rms_deg = 0.0;
  double yaw_mean_deg = 0.0;  // positive: the track is turned clockwise
  std::uint64_t states = 0;
};

// Errors of a track before and after the correction by the graph.
struct TruthComparison {
  TrackError before;  // of dead reckoning
  TrackError after;   // of the delivered track; the same as `before` where that is dead reckoning
  // The same after alignment: the rigid motion in x, y and yaw that fits the track's positions best
  // to the truth is applied first (absolute trajectory error of Sturm et al. 2012). "Shape" in
  // pages and reports.
  TrackError before_aligned;
  TrackError after_aligned;
};

// Normalised squared errors (NEES) of loop closures with respect to the truth: e' information e.
struct ClosureErrors {
  std::uint64_t closures = 0;
  std::uint64_t degrees_of_freedom = 0;  // sum of the ranks of their information
  double chi2 = 0.0;  // sum of the NEES; about degrees_of_freedom if covariances are consistent
  double worst_chi2 = 0.0;  // largest of one closure; above 16 with p = 0.001 at rank 3
};

// Errors of a track. The truth is interpolated to each state of the track that lies between two
// truth states at most 1 s apart; other states are left out. Empty where no state is left.
std::optional<TruthComparison> CompareWithTruth(const std::vector<CorrectedState>& track,
                                                const std::vector<TruthState>& truth);

// The same for the poses that were published live: `before` is PublishedState::nav, `after` is
// PublishedState::corrected.
std::optional<TruthComparison> ComparePublishedWithTruth(
    const std::vector<PublishedState>& published, const std::vector<TruthState>& truth);

// Errors of the loop closures that the solution accepts (inlier weight at least 0.5). Empty where
// for no closure the truth is known at both submap frames.
std::optional<ClosureErrors> CompareClosuresWithTruth(const Survey& survey,
                                                      const std::vector<TruthState>& truth);

}  // namespace seastitch
