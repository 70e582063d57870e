#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"

// What mapper and optimizer tell each other. A vertex is the level frame of a submap: x, y, yaw.
// Solved, it is where its soundings belong, which is not quite where the vehicle was
// (MountingErrors).
namespace seastitch {

struct GraphVertex {
  SubmapId id;
  Time time;
  Pose2 dead_reckoned;  // T_map_level
  // One sigma of dead_reckoned.yaw against north, where it is known.
  std::optional<double> heading_sigma_rad{};
  // Dive that the submap belongs to. Dead reckoning joins submaps of one chain only.
  std::int32_t chain = 0;
};

enum class EdgeKind : std::uint8_t { kDeadReckoning, kLoopClosure, kPositionFix };

// Why a registration became a loop closure, or did not.
enum class LoopVerdict : std::uint8_t {
  kAccepted,
  kAmbiguous,   // two places fit alike
  kDegenerate,  // the seabed does not say where it belongs
  kPoorFit,     // residuals above the noise
  kLittleOverlap,
  kOutsideWindow,  // further off than the navigation can be
  kNotConverged,
};
const char* ToString(EdgeKind kind);
const char* ToString(LoopVerdict verdict);

struct GraphEdge {
  EdgeKind kind = EdgeKind::kDeadReckoning;
  SubmapId from;  // == to: of T_map_level itself. A position fix, or where dead reckoning starts
  SubmapId to;
  Pose2 T_from_to;  // level frames, as measured: see ByMounting()
  // Inverse covariance of (x, y [m], yaw [rad]) in the axes of `from`; may be singular: a
  // direction without information is left free.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  LoopVerdict verdict = LoopVerdict::kAccepted;  // only accepted edges pull
  // Of a loop closure: by how much the seabed of `to` lies below that of `from`, and the fit.
  double z_offset_m = 0.0;
  double rms_m = 0.0;
  double overlap_m2 = 0.0;
  Eigen::Vector2d overlap_center_m = Eigen::Vector2d::Zero();  // axes of `from`
};

// True less stated, by (sonar_m, dvl_yaw_rad) of MountingErrors: dead reckoning and fixes speak of
// the vehicle, closures of sheared soundings, and vertices stand where soundings belong.
Eigen::Matrix3d ByMounting(const GraphEdge& edge);

// What one message holds; the sender splits what is more.
constexpr int kMaxVerticesPerUpdate = 200;
constexpr int kMaxEdgesPerUpdate = 200;
constexpr int kMaxCovariancePairs = 500;

// One step of the mapper's graph. Versions count up from 1 without a hole: update n holds what
// version n has beyond n - 1, so whoever has 1..n has all of it.
struct GraphUpdate {
  std::int64_t version = 0;
  std::vector<GraphVertex> vertices;
  std::vector<GraphEdge> edges;
  MountingSigmas mounting{};
  // Names the graph: the time of the first navigation state of the mapper that began it [us].
  std::int64_t graph_id = 0;
  bool final = false;    // the mapper has stopped: solve once from dead reckoning
  bool resumed = false;  // the first update after a resume: solve once from dead reckoning
};

struct SolvedVertex {
  SubmapId id;
  Pose2 T_map_level;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // x, y, yaw; map axes
  // Cross-covariance of this vertex (rows) with the newest vertex (columns); map axes. With the two
  // marginals it gives the relative covariance that the overlap search needs.
  Eigen::Matrix3d covariance_with_newest = Eigen::Matrix3d::Zero();
};

// Of the weight of a loop closure in a solution: from here on it counts as believed.
constexpr double kBelievedWeight = 0.5;

struct SolvedEdge {
  SubmapId from;
  SubmapId to;
  double weight = 1.0;  // of the robust loss, 0 (refused) to 1 (fully believed)
};

// The optimizer's answer to everything up to graph_version.
struct PoseGraph {
  std::int64_t graph_version = 0;
  std::vector<SolvedVertex> vertices;  // by rising id
  std::vector<SolvedEdge> loop_edges;
  MountingErrors mounting{};
  std::int64_t graph_id = 0;
};

// What a PoseGraph does not hold, on demand: how well the relative pose of any two of its vertices
// is known.
struct CovarianceRequest {
  std::string sender;
  std::int64_t seq = 0;
  std::int64_t graph_version = 0;
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
