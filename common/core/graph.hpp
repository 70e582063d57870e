#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"

// Data that mapper and optimizer exchange. A vertex is the level frame of a submap: x, y [m], yaw
// [rad] in the map. A dead-reckoned vertex is the vehicle's pose. A solved vertex is the pose of
// the submap's soundings: it differs from the vehicle's pose by the estimated offset of the sonar
// (MountingErrors).
namespace seastitch {

struct GraphVertex {
  SubmapId id;
  Time time;            // Submap::frame_time
  Pose2 dead_reckoned;  // T_map_level
  // 1 sigma of dead_reckoned.yaw with respect to true north. Absent: the graph has no heading
  // factor for this submap.
  std::optional<double> heading_sigma_rad{};
  // Number of the dive, from 0. Dead reckoning joins submaps of one dive only.
  std::int32_t chain = 0;
};

enum class EdgeKind : std::uint8_t { kDeadReckoning, kLoopClosure, kPositionFix };

// Result of a registration: accepted as a loop closure, or why it was rejected. Rejected ones are
// edges, too, so that the report can show them.
enum class LoopVerdict : std::uint8_t {
  kAccepted,
  kAmbiguous,      // two alignments fit about equally well
  kDegenerate,     // the seabed has too little structure to determine the pose
  kPoorFit,        // residuals exceed max_residual_ratio times the expected noise
  kLittleOverlap,  // too small an area in common
  kOutsideWindow,  // outside the uncertainty of the prior
  kNotConverged,   // the refinement did not converge
};
const char* ToString(EdgeKind kind);
const char* ToString(LoopVerdict verdict);

struct GraphEdge {
  EdgeKind kind = EdgeKind::kDeadReckoning;
  // from == to: a prior on the pose of that submap in the map. Kind kPositionFix: a fix. Kind
  // kDeadReckoning: the start of a dive, from the navigation filter.
  SubmapId from;
  SubmapId to;
  // Measured relative pose of the level frames, without the mounting errors' correction
  // (ByMounting()). Of a prior: T_map_level.
  Pose2 T_from_to;
  // Inverse covariance of (x, y [m], yaw [rad]) of T_from_to, in the axes of `from` (a prior: of
  // the map). May be singular: zero along directions that are not measured.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  LoopVerdict verdict = LoopVerdict::kAccepted;  // the graph uses accepted edges only
  // Of a loop closure: depth of the seabed in `to` less that in `from` after alignment.
  double z_offset_m = 0.0;
  double rms_m = 0.0;                                          // of the vertical residuals
  double overlap_m2 = 0.0;                                     // common area
  Eigen::Vector2d overlap_center_m = Eigen::Vector2d::Zero();  // axes of `from`
  // Angle of the DVL about the vertical [rad] in the dive of `to` by which it was measured, as
  // navigation estimated it then: dead reckoning went by it, clouds were straightened to it.
  double dvl_yaw_rad = 0.0;
};

// Jacobians of an edge's measurement with respect to the mounting errors of the dives of `from` and
// of `to`: rows x, y [m], yaw [rad] in the axes of `from` (a prior: of the map), columns sonar_m.x,
// sonar_m.y [m], dvl_yaw_rad [rad]. True value = measurement + of_from * (errors of the dive of
// `from`) + of_to * (those of the dive of `to`), each as MountingErrors::Vector(). The reason: dead
// reckoning and fixes measure the vehicle's pose and closures that of sheared clouds, while solved
// vertices are poses of soundings.
struct EdgeByMounting {
  Eigen::Matrix3d of_from = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d of_to = Eigen::Matrix3d::Zero();
};
// of_one_dive: whether both submaps are of one dive. If so, of_to is the whole and of_from is zero.
EdgeByMounting ByMounting(const GraphEdge& edge, bool of_one_dive);
// The measurement as it is by the angle of the DVL that navigation estimates now: that of the
// newest submap in the dive of `to` (Submap::dvl_yaw_rad). Mounting errors are relative to it.
Pose2 MeasuredBy(double newest_dvl_yaw_rad, const GraphEdge& edge, const EdgeByMounting& by);
// The correction of that measurement: of_from * (errors) + of_to * (errors).
Eigen::Vector3d MountingCorrection(const EdgeByMounting& by,
                                   const MountingErrors& from,
                                   const MountingErrors& to);

// Limits of one message. The mapper splits a larger update into several versions.
constexpr int kMaxVerticesPerUpdate = 200;
constexpr int kMaxEdgesPerUpdate = 200;
constexpr int kMaxCovariancePairs = 500;

// Whether a graph whose last solution has `solved` submaps is to be solved again: with every
// version up to 100 submaps, then with every 100th part more of them. CPU time and messages of a
// submap then stay the same, however long the dive. A function of the graph alone.
bool IsSolutionDue(std::size_t submaps, std::size_t solved);

// An increment of the mapper's graph. Versions count up from 1 without gaps. Update n has the
// vertices and edges that version n adds to version n - 1, so updates 1 to n make up version n. A
// later edge between the same submaps replaces the earlier one; vertices never change.
struct GraphUpdate {
  std::int64_t version = 0;
  std::vector<GraphVertex> vertices;
  std::vector<GraphEdge> edges;
  // A priori sigmas of the mounting errors of the dive whose vertices this update has; zero: not
  // estimated. All vertices of an update are of one dive.
  MountingSigmas mounting{};
  // Identifies the graph: a random number live; in a replay the time of the first navigation state.
  std::int64_t graph_id = 0;
  // The next solution starts from dead-reckoned poses instead of the last solution.
  bool final = false;    // because the mapper has stopped
  bool resumed = false;  // because this is the first update after a resume
};

struct SolvedVertex {
  SubmapId id;
  Pose2 T_map_level;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // x, y, yaw; map axes
  // Cross-covariance of this vertex (rows) with the newest vertex (columns); map axes. With both
  // covariances it gives that of the relative pose, which the search for overlaps needs.
  Eigen::Matrix3d covariance_with_newest = Eigen::Matrix3d::Zero();
};

// Smallest inlier weight with which a loop closure or position fix counts as accepted by the graph.
constexpr double kAcceptedWeight = 0.5;

struct SolvedEdge {
  SubmapId from;
  SubmapId to;
  double weight = 1.0;  // inlier weight, 0 (not used) to 1 (used in full)
};

// "Do no harm", live and in a replay: a solution that leaves less than this share of what two
// submaps overlap by dead reckoning is withheld.
constexpr double kOverlapKept = 0.2;

// Solution of the graph up to graph_version, by the optimizer.
struct PoseGraph {
  std::int64_t graph_version = 0;
  std::vector<SolvedVertex> vertices;  // by rising id
  std::vector<SolvedEdge> loop_edges;
  // Mounting errors of each dive, by its chain number. A dive whose errors are not estimated is
  // left out.
  std::map<std::int32_t, MountingErrors> mounting{};
  std::int64_t graph_id = 0;

  // Those of one dive; zero where they are not estimated.
  MountingErrors MountingOf(std::int32_t chain) const;
};

// Request for the covariances of relative poses of pairs of vertices, which a PoseGraph does not
// have.
struct CovarianceRequest {
  std::string sender;
  std::int64_t seq = 0;
  std::int64_t graph_version = 0;  // of the optimizer's newest solution; else there is no answer
  std::vector<std::pair<SubmapId, SubmapId>> pairs;
  std::int64_t graph_id = 0;
};

struct PairCovariance {
  SubmapId a;
  SubmapId b;
  Eigen::Matrix3d covariance;  // of T_a_b: x, y [m], yaw [rad]; axes of a
};

struct PairCovariances {
  std::string recipient;  // the sender of the request
  std::int64_t request_seq = 0;
  std::int64_t graph_version = 0;
  std::vector<PairCovariance> pairs;
  std::int64_t graph_id = 0;
};

}  // namespace seastitch
