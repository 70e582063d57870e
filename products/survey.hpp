#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/ids.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// A submap without its points, which are in cloud_file. The map frame is local North-East-Down
// (imported submaps: MapAxes); the level frame has the submap's origin and yaw, without roll and
// pitch (docs/frames.md).
struct SurveySubmap {
  SubmapId id;
  std::int32_t chain = 0;  // number of the dive: index into Survey::dives
  Time start;              // first ping
  Time end;                // last ping
  Time frame_time;         // middle ping: the submap frame is the vehicle's pose at this time
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();  // dead reckoned
  SubmapTrigger trigger = SubmapTrigger::kEnd;                     // why the submap was closed
  std::uint64_t soundings_read = 0;                                // beams that the sonar delivered
  std::uint64_t soundings_used = 0;  // of these, without those that filters left out
  std::uint64_t points = 0;          // in the cloud, after voxel averaging of the soundings used
  Footprint footprint;               // corners as the mapper published them, level frame [m]
  Footprint hull;                    // convex hull of the points, level frame [m]
  double dvl_yaw_rad = 0.0;          // Submap::dvl_yaw_rad
  std::filesystem::path cloud_file;  // PCD file; empty where the submap has no point
};

// Dead-reckoned state of the vehicle's reference point at one time, map frame.
struct TrackState {
  Time time;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();    // [m]
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();  // roll, pitch, yaw: RotationFromRpy()
  // 1 sigma of x, y [m], yaw [rad], from the covariance in the message NAV.
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  std::int32_t chain = 0;
  // x, y [m], yaw [rad] as navigation knew them later (Navigation::TakeSmoothed()): only the shape
  // of the track counts. Absent where it does not correct its past.
  std::optional<Pose2> smoothed{};

  Pose2 Level() const { return {p_map.x(), p_map.y(), rpy_rad.z()}; }
  Pose2 Smoothed() const { return smoothed.value_or(Level()); }
};
TrackState ToTrackState(const NavState& state, std::int32_t chain);

// The vehicle's pose as the mapper published it live: dead reckoned (NAV, extrapolated to `time`
// with the newest inertial samples) and corrected by the graph (NAV_CORRECTED). Map frame.
struct PublishedState {
  Time time;
  Pose2 nav;
  Pose2 corrected;
};

// One input file, with the times of its first and last ping.
struct SurveyInput {
  std::string name;
  Time first;
  Time last;
};

// A whole survey, ready to become files.
struct Survey {
  std::vector<SurveySubmap> submaps;  // by rising id; ids rise with the chain
  // By chain, then by rising time; empty where submaps were imported without a log.
  std::vector<TrackState> track;
  std::vector<PublishedState> published;  // by rising time; empty where there was no NAV_CORRECTED
  std::vector<GraphEdge> edges;           // in the order of the graph's versions
  PoseGraph solution;                     // the newest; without vertices where nothing was solved
  std::vector<std::string> dives;         // names, where there are several
  std::vector<SurveyInput> inputs;        // in the order in which they were given
  std::map<std::string, std::uint64_t> counters;  // input rejected while collecting, by reason

  // End of the last submap with soundings, whatever the order of the dives; the epoch without one.
  Time End() const;
  // Number of submaps with soundings (HasSoundings()), of one dive or of all.
  std::size_t Mapped(std::optional<std::int32_t> chain = std::nullopt) const;
  // Submap::dvl_yaw_rad of the newest submap of a dive, to which its mounting errors are relative.
  double NewestDvlYaw(std::int32_t chain) const;
  // Name of the input whose pings enclose that time; of several, the one of shortest duration.
  // Empty: there is none.
  std::string InputAt(Time time) const;
};

// Poses at which the clouds of all submaps are drawn.
struct SurveyPoses {
  // Level frame of each submap, in the order of survey.submaps: where its soundings belong. The
  // vehicle's own pose differs by the sonar's offset: VehiclePose().
  std::vector<Pose2> T_map_level;
  // Estimated mounting errors of each submap's dive, in the same order; empty: they are zero.
  std::vector<MountingErrors> mounting{};
  // What navigation learnt of the DVL's angle after each submap was built; empty: nothing.
  std::vector<double> learnt_yaw_rad{};

  MountingErrors MountingOf(std::size_t submap) const {
    return mounting.empty() ? MountingErrors{} : mounting[submap];
  }
  // By how much a submap's cloud is sheared (Shear()): by the angle that the graph estimates for
  // the dive, and by what navigation learnt later.
  double ShearOf(std::size_t submap) const {
    return MountingOf(submap).dvl_yaw_rad + (learnt_yaw_rad.empty() ? 0.0 : learnt_yaw_rad[submap]);
  }
  // Pose of the vehicle at the frame of a submap.
  Pose2 VehicleAt(std::size_t submap) const {
    return VehiclePose(T_map_level[submap], MountingOf(submap));
  }
};

SurveyPoses DeadReckonedPoses(const Survey& survey);

// Poses of the graph's solution. A submap that the solution does not have is extrapolated from its
// predecessor by dead reckoning; without a predecessor in its dive it stays dead reckoned.
SurveyPoses SolvedPoses(const Survey& survey);

// Standard deviations of x, y [m], yaw [rad] of the solved frames, map axes. Absent where the
// solution has no covariance. They include the uncertainty of the sonar's offset, because they are
// those of the soundings.
std::vector<std::optional<Eigen::Vector3d>> SolvedSigmas(const Survey& survey);

// A loop closure as the report and the layers of survey.gpkg show it.
struct LoopRow {
  const GraphEdge* edge;  // in survey.edges
  double weight;          // inlier weight, 0 to 1; NaN where the edge was not in the solution
};
std::vector<LoopRow> LoopRows(const Survey& survey);

// T_map_submap with x, y and yaw of T_map_level. z, roll and pitch stay: the graph never corrects
// them.
Eigen::Isometry3d SubmapPose(const SurveySubmap& submap, const Pose2& T_map_level);

}  // namespace seastitch
