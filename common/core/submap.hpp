#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Points in their submap's frame only: float keeps 10 um at 100 m there, and loses 0.5 m in UTM.
// soundings[i]: how many soundings points[i] stands for (a voxel's centroid has several).
struct PointCloud {
  std::vector<Eigen::Vector3f> points;
  std::vector<float> soundings;

  std::size_t size() const { return points.size(); }
  bool empty() const { return points.empty(); }
  void Add(const Eigen::Vector3f& p, float n = 1.0f) {
    points.push_back(p);
    soundings.push_back(n);
  }
};

// Corners in order, not closed, in the level frame of the submap [m].
using Footprint = std::vector<Eigen::Vector2d>;

enum class SubmapTrigger : std::uint8_t {
  kInformation,  // it holds enough structure to be registered
  kLength,       // dead reckoning can no longer be trusted inside it
  kTurn,         // the line ends
  kGap,          // the data break off
  kEnd,          // the survey ends
  kImported,     // cut by somebody else
};
const char* ToString(SubmapTrigger trigger);

// A piece of seabed seen within so short a track that dead reckoning holds inside it.
struct Submap {
  SubmapId id;
  Time start;  // first and last ping
  Time end;
  Time frame_time;  // middle ping
  // Dead-reckoned vehicle pose at frame_time: the submap's frame.
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();
  // Covariance of x, y, yaw of T_map_submap relative to the previous submap's frame, in the
  // previous submap's level axes (Sigma of III-B-1). Nothing for the first.
  std::optional<Eigen::Matrix3d> covariance_from_previous;
  // One sigma of the yaw of T_map_submap against north, where it is known.
  std::optional<double> heading_sigma_rad;
  // By what part of itself an offset of the sonar that nobody told bends the submap, RMS over its
  // pings: twice the sine of half the heading off the frame's. 0 on a straight line.
  double heading_spread = 0.0;
  SubmapTrigger trigger = SubmapTrigger::kEnd;
  // Information (x, y, yaw; level axes) that registering this terrain is predicted to give, where
  // that was computed.
  std::optional<Eigen::Matrix3d> predicted_information;
  std::uint64_t soundings_read = 0;  // beams that the sonar delivered
  std::uint64_t soundings_used = 0;  // of these, behind the points of the cloud
  Footprint footprint;
  PointCloud cloud;
};

}  // namespace seastitch
