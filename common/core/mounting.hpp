#pragma once

#include <Eigen/Core>

#include "common/core/pose.hpp"

// Mounting errors: differences between the true mounting of sonar and DVL and that in vehicle.yaml.
// They are the same in every submap of a dive, so that moving submaps cannot correct them. Each
// dive has its own. To first order three numbers describe all that is observable:
//
// * Offset of the sonar, forward and to starboard: lines of opposite heading are shifted by twice
//   the offset. A latency (times speed) and a pitch angle (times altitude) act like an offset
//   forward.
// * Angle of the DVL about the vertical, relative to the sonar: each submap is sheared, because its
//   pings lie along the direction of travel that the DVL states, but extend across the sonar's
//   axis.
namespace seastitch {

// Estimated mounting errors: true value less configured value.
struct MountingErrors {
  Eigen::Vector2d sonar_m = Eigen::Vector2d::Zero();  // forward, to starboard
  double dvl_yaw_rad = 0.0;                           // relative to the sonar, clockwise from above
  // Of Vector().
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  Eigen::Vector3d Vector() const { return {sonar_m.x(), sonar_m.y(), dvl_yaw_rad}; }
};

// A priori 1 sigma of mounting errors; 0: the error is not estimated.
struct MountingSigmas {
  double sonar_m = 0.0;  // each axis
  double dvl_yaw_rad = 0.0;

  Eigen::Vector3d Vector() const { return {sonar_m, sonar_m, dvl_yaw_rad}; }
  bool AreAllZero() const { return sonar_m == 0.0 && dvl_yaw_rad == 0.0; }
  // True: 0 to 10 m, and 0 to pi.
  bool AreUsable() const;
};

// The functions below hold to first order and on straight lines. In a turn the sonar's offset
// rotates with every ping, while a submap has one frame.

// Pose of a submap's soundings from the vehicle's pose, and back.
Pose2 SoundingPose(const Pose2& T_map_vehicle, const MountingErrors& errors);
Pose2 VehiclePose(const Pose2& T_map_level, const MountingErrors& errors);

// Relative pose of the vehicle from its dead-reckoned relative pose, corrected by dvl_yaw_rad.
Pose2 TravelledPose(const Pose2& T_from_to, const MountingErrors& errors);

// Correction to be added to a sounding at p in its level frame [m], when that frame is
// SoundingPose(): the shear by an angle of the DVL.
Eigen::Vector2d Shear(const Eigen::Vector2d& p_level_m, double dvl_yaw_rad);

// LevelFromBody() with the Shear() by an angle: takes soundings that were placed by another angle
// of the DVL, smaller by added_yaw_rad, to where they belong in the level frame.
Eigen::Matrix3d StraightFromBody(const Eigen::Isometry3d& T_map_submap, double added_yaw_rad);

// Jacobians of measured relative poses with respect to (sonar_m.x, sonar_m.y, dvl_yaw_rad): rows x,
// y [m], yaw [rad] in the axes of `from`; true value = measured value + Jacobian * errors. The row
// of yaw is zero. For a closure that holds where its lines are parallel, or cross near the middle
// of both submaps. center_from_m: centre of the overlap, axes of `from`.
Eigen::Matrix3d DeadReckoningByMounting(const Pose2& T_from_to);
Eigen::Matrix3d LoopClosureByMounting(const Pose2& T_from_to, const Eigen::Vector2d& center_from_m);
// The two terms of LoopClosureByMounting(): the part by the errors of the dive of `from`, and the
// part by those of the dive of `to`. For a closure between two dives.
Eigen::Matrix3d LoopClosureByMountingOfFrom(const Eigen::Vector2d& center_from_m);
Eigen::Matrix3d LoopClosureByMountingOfTo(const Pose2& T_from_to,
                                          const Eigen::Vector2d& center_from_m);
// The same of the vehicle's position in the map, for the position of its soundings; yaw_rad: its
// heading.
Eigen::Matrix3d PositionByMounting(double yaw_rad);

}  // namespace seastitch
