#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"
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
  std::uint64_t states = 0;
};

struct TruthComparison {
  TrackError before;  // dead reckoning
  TrackError after;   // the track that was delivered
  // The same without any alignment: what an absolute position would be off by.
  TrackError before_unaligned;
  TrackError after_unaligned;
};

// Compares at every state of the track that lies between two truth states at most 1 s apart. The
// truth is moved, in x, y and yaw, so that it meets the track at `align_time`, the frame of the
// first submap: the graph holds that one fixed, so where it lies cannot be known from the map.
// Nothing else is aligned. Empty where truth and track share no time or align_time is not covered.
std::optional<TruthComparison> CompareWithTruth(const std::vector<CorrectedState>& track,
                                                const std::vector<TruthState>& truth,
                                                Time align_time);

}  // namespace seastitch
