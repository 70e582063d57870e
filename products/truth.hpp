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
  double yaw_mean_deg = 0.0;  // positive clockwise: which way all of it is turned
  std::uint64_t states = 0;
};

struct TruthComparison {
  TrackError before;  // dead reckoning
  TrackError after;   // the track that was delivered
  // The same after the rigid motion in x, y and yaw that lays the track best on the truth: the
  // shape of the map alone, whatever the start was off by (absolute trajectory error of Sturm et
  // al. 2012).
  TrackError before_aligned;
  TrackError after_aligned;
};

// How far loop closures are from the truth: squared errors over what their information says of
// them.
struct ClosureErrors {
  std::uint64_t closures = 0;
  std::uint64_t degrees_of_freedom = 0;  // directions that they know, together
  double chi2 = 0.0;                     // honest ones: about as many
  double worst_chi2 = 0.0;  // of one; beyond 16 goes one honest one of three directions in 1000
};

// Compares at every state of the track that lies between two truth states at most 1 s apart. Empty
// where track and truth share no time.
std::optional<TruthComparison> CompareWithTruth(const std::vector<CorrectedState>& track,
                                                const std::vector<TruthState>& truth);

// The same of what the vehicle was told at each instant: before is NAV, carried on to the instant,
// after is NAV_CORRECTED.
std::optional<TruthComparison> CompareSaidWithTruth(const std::vector<SaidState>& said,
                                                    const std::vector<TruthState>& truth);

// Of what the solution believes. Empty where no closure has the truth at both of its frames.
std::optional<ClosureErrors> CompareClosuresWithTruth(const Survey& survey,
                                                      const std::vector<TruthState>& truth);

}  // namespace seastitch
