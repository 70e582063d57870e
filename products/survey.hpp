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
#include "common/core/submap.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// A submap without its points, which are in cloud_file.
struct SurveySubmap {
  SubmapId id;
  std::int32_t chain = 0;  // the dive, by its place in Survey::dives
  Time start;              // first and last ping
  Time end;
  Time frame_time;
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();  // dead reckoned
  SubmapTrigger trigger = SubmapTrigger::kEnd;
  std::uint64_t soundings_read = 0;
  std::uint64_t soundings_used = 0;
  std::uint64_t points = 0;
  Footprint footprint;               // level frame
  Footprint hull;                    // convex hull of the points, level frame
  std::filesystem::path cloud_file;  // empty where the submap has no point
};

// Dead-reckoned vehicle state at one time, map frame.
struct TrackState {
  Time time;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  // of x, y [m], yaw [rad], as NAV states them
  std::int32_t chain = 0;
};

// Poses that the mapper published live for one instant: NAV, carried on to it by the newest
// samples, and NAV_CORRECTED.
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
  std::vector<SurveySubmap> submaps;  // by rising id, and so by chain
  // By chain, then by rising time; empty for imported submaps.
  std::vector<TrackState> track;
  std::vector<PublishedState> published;  // by rising time; empty where there was no NAV_CORRECTED
  std::vector<GraphEdge> edges;           // in the order of the graph's versions
  PoseGraph solution;                     // the newest; without vertices where nothing was solved
  std::vector<std::string> dives;         // names, where there are several
  std::vector<SurveyInput> inputs;        // in the order in which they were given
  std::map<std::string, std::uint64_t> counters;  // input refused while collecting, by reason

  // Name of the input that has pings at that time, the shortest of several; empty: none has.
  std::string InputAt(Time time) const;
};

// Frames of all submaps in the map: where their soundings are.
struct SurveyPoses {
  std::vector<Pose2> T_map_level;  // in the order of survey.submaps
  MountingErrors mounting{};       // shear the clouds, and shift them from the vehicle
};

SurveyPoses DeadReckonedPoses(const Survey& survey);

// Frames of the graph's solution. A submap that is not in it follows its predecessor by dead
// reckoning; without a predecessor it stays dead reckoned.
SurveyPoses SolvedPoses(const Survey& survey);

// Standard deviations of x, y [m], yaw [rad] of the solved frames, map axes; absent where the
// solution has none. The uncertainty of the sonar's mounting is included.
std::vector<std::optional<Eigen::Vector3d>> SolvedSigmas(const Survey& survey);

// A loop closure as the report and the layers show it.
struct LoopRow {
  const GraphEdge* edge;
  double weight;  // inlier weight, 0 to 1; NaN where the edge was not in the solution
};
std::vector<LoopRow> LoopRows(const Survey& survey);

// T_map_submap with its level pose replaced: z, roll and pitch are never corrected.
Eigen::Isometry3d SubmapPose(const SurveySubmap& submap, const Pose2& T_map_level);

}  // namespace seastitch
