#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "products/survey.hpp"
#include "products/track.hpp"

namespace seastitch {

struct TruthState {
  Time time;
  Pose2 T_map_level;
};

// Reads a truth file: the header line "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg", then one
// state of the vehicle a line, map frame, times strictly rising. Throws std::runtime_error
// "FILE:LINE: reason" at the first line that is anything else.
std::vector<TruthState> ReadTruth(const std::filesystem::path& path);

// Horizontal position and heading error along a track.
struct TrackError {
  double position_rms_m = 0.0;
  double position_max_m = 0.0;
  double position_end_m = 0.0;  // at the last state compared
  double yaw_rms_deg = 0.0;
  double yaw_mean_deg = 0.0;  // positive: the track is turned clockwise
  std::uint64_t states = 0;
};

struct TruthComparison {
  TrackError before;  // dead reckoning
  TrackError after;   // the track that was delivered
  // Errors of the shape alone: what remains after the rigid motion in x, y and yaw that fits the
  // track best to the truth (absolute trajectory error of Sturm et al. 2012).
  TrackError before_aligned;
  TrackError after_aligned;
};

// Errors of loop closures against the truth: squared errors over their stated covariance.
struct ClosureErrors {
  std::uint64_t closures = 0;
  std::uint64_t degrees_of_freedom = 0;  // sum of the ranks of their information
  double chi2 = 0.0;                     // about degrees_of_freedom where they are honest
  double worst_chi2 = 0.0;  // of one closure; one honest one of rank 3 in 1000 exceeds 16
};

// Compares at every state of the track that lies between two truth states at most 1 s apart. Empty
// where track and truth share no time.
std::optional<TruthComparison> CompareWithTruth(const std::vector<CorrectedState>& track,
                                                const std::vector<TruthState>& truth);

// Errors of the poses that were published live: before is NAV, carried on to the instant, after is
// NAV_CORRECTED.
std::optional<TruthComparison> ComparePublishedWithTruth(
    const std::vector<PublishedState>& published, const std::vector<TruthState>& truth);

// Of the closures that the solution accepts. Empty where no closure has the truth at both frames.
std::optional<ClosureErrors> CompareClosuresWithTruth(const Survey& survey,
                                                      const std::vector<TruthState>& truth);

}  // namespace seastitch
