#pragma once

#include <Eigen/Core>

#include "common/core/pose.hpp"

// What vehicle.yaml says wrong of the sensors is the same in every submap of a survey, and no
// closure can mend it by moving submaps. To first order three numbers hold all of it that shows:
//
// * The sonar stands elsewhere: lines of opposite heading are shifted against each other by twice
//   that. Latency (x speed) and a pitch angle (x altitude) act like a shift forward.
// * The DVL's axes are turned against the sonar's: each submap is sheared, since its soundings are
//   laid out along another direction than the one they were taken across.
namespace seastitch {

// True less told.
struct MountingErrors {
  Eigen::Vector2d sonar_m = Eigen::Vector2d::Zero();  // forward, to starboard
  double dvl_yaw_rad = 0.0;                           // clockwise from above, against the sonar
  // Of sonar_m and dvl_yaw_rad.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  Eigen::Vector3d Vector() const { return {sonar_m.x(), sonar_m.y(), dvl_yaw_rad}; }
};

// What is known of them beforehand, 1 sigma; 0: there is no such error.
struct MountingSigmas {
  double sonar_m = 0.0;  // each axis
  double dvl_yaw_rad = 0.0;

  Eigen::Vector3d Vector() const { return {sonar_m, sonar_m, dvl_yaw_rad}; }
  bool AreAllZero() const { return sonar_m == 0.0 && dvl_yaw_rad == 0.0; }
  // Not above 10 m and half a circle: more is no mounting.
  bool AreUsable() const;
};

// To first order, and on straight lines: in a turn the sonar's offset turns with every ping, which
// no frame can follow, and soundings ahead of the frame are not those that were taken later.

// Where the soundings of a submap belong, taken from where the vehicle was, and back.
Pose2 SoundingPose(const Pose2& T_map_vehicle, const MountingErrors& errors);
Pose2 VehiclePose(const Pose2& T_map_level, const MountingErrors& errors);

// Where the vehicle went, from where the DVL told that it went.
Pose2 TravelledPose(const Pose2& T_from_to, const MountingErrors& errors);

// By how much a sounding that was told to be at p in its level frame lies elsewhere: what is left
// of the errors when the frame stands where its soundings belong.
Eigen::Vector2d Shear(const Eigen::Vector2d& p_level_m, const MountingErrors& errors);

// How measured relative poses change with (sonar_m, dvl_yaw_rad), to first order and in the axes of
// `from`: true less measured, x, y [m], yaw [rad]. Yaw stays what it is: of a closure that is so
// where the lines are parallel, or cross near the middle of both submaps.
Eigen::Matrix3d DeadReckoningByMounting(const Pose2& T_from_to);
Eigen::Matrix3d LoopClosureByMounting(const Pose2& T_from_to, const Eigen::Vector2d& center_from_m);
// The same of a vehicle's position in the map, for the place where its soundings belong.
Eigen::Matrix3d PositionByMounting(double yaw_rad);

}  // namespace seastitch
