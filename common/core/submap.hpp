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

// Points in the frame of their submap [m], never in the map: float has a resolution of 10 um at 100
// m, but of 0.5 m at UTM coordinates. soundings[i]: number of soundings that points[i] is the mean
// of; the voxel filter averages several.
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

// Outline of a submap: corners in order, first not repeated, in its level frame [m] (the cloud is
// in the submap frame).
using Footprint = std::vector<Eigen::Vector2d>;

// Why a submap was closed.
enum class SubmapTrigger : std::uint8_t {
  kInformation,  // it has enough structure to be registered
  kLength,       // its track is so long that the drift of dead reckoning matters
  kTurn,         // the survey line ended
  kGap,          // soundings or navigation were missing for a time
  kEnd,          // the survey ended
  kImported,     // another program made the submap
  kFixes,        // it has no soundings: a frame of the track for position fixes far from any other
};
const char* ToString(SubmapTrigger trigger);
constexpr bool HasSoundings(SubmapTrigger trigger) { return trigger != SubmapTrigger::kFixes; }

// Soundings of a stretch of track so short that the drift of dead reckoning within it is
// negligible.
struct Submap {
  SubmapId id;
  Time start;       // first ping
  Time end;         // last ping
  Time frame_time;  // middle ping, by count
  // The submap's frame: dead-reckoned pose of the vehicle at frame_time.
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();
  // Covariance of the pose of this frame relative to the previous submap's (x, y [m], yaw [rad]),
  // in the previous submap's level axes (Sigma in section III-B-1 of the paper). Absent for the
  // first submap of a dive.
  std::optional<Eigen::Matrix3d> covariance_from_previous;
  // Level frame of this submap in that of the previous one by dead reckoning, as navigation knows
  // it at frame_time: the difference of both T_map_submap also has what it learnt in between of the
  // way before the previous submap. Absent: that difference.
  std::optional<Pose2> T_previous_level;
  // 1 sigma of the yaw of T_map_submap with respect to true north, where it is known.
  std::optional<double> heading_sigma_rad;
  // Distortion of the submap per metre of an unknown lever-arm error of the sonar, RMS over its
  // pings [m/m]: 2 sin(a / 2), where a is the heading of a ping less that of the frame. 0 on a
  // straight line.
  double heading_spread = 0.0;
  // Distortion along the track by a part of it without bottom lock, 1 sigma per metre from the
  // frame [m/m]; 0: none.
  double drift_per_m = 0.0;
  // Angle of the DVL about the vertical [rad] by which its soundings were placed: the mean of
  // navigation's estimates while it was built; 0 where it estimates none. A later estimate says how
  // far the submap is sheared: StraightFromBody().
  double dvl_yaw_rad = 0.0;
  SubmapTrigger trigger = SubmapTrigger::kEnd;
  // Information of x, y [1/m2], yaw [1/rad2] (level axes) that a registration of this submap with
  // the expected overlap is predicted to have, from its relief. Absent where it was not computed.
  std::optional<Eigen::Matrix3d> predicted_information;
  std::uint64_t soundings_read = 0;  // beams that the sonar delivered, invalid ones included
  std::uint64_t soundings_used = 0;  // of these, averaged into the points of the cloud
  Footprint footprint;
  PointCloud cloud;
};

}  // namespace seastitch
