#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/information.hpp"
#include "optimizer/heading_chain.hpp"
#include "optimizer/relative_pose_cost.hpp"

namespace seastitch {

struct FactorGraph;
struct GraphCovariance;
struct RobustSolution;
struct SolverStart;

struct OptimizerParams {
  // A loop closure or position fix whose squared Mahalanobis distance from the solution is below
  // this quantile of chi-square (degrees of freedom: the rank of its information) is believed.
  // 0.999 loses one honest closure in a thousand; a wrong one is rarely within 4 sigma.
  double inlier_probability = 0.999;
  // Factor between two stages of the graduation. The literature has 1.4; on simulated surveys with
  // up to 70 % wrong closures 2, 4 and 10 gave the same answer, so this is the quick one.
  double graduation_step = 4.0;
  // Steps of Newton's method in the last stage; a survey takes 5 to 30.
  int max_iterations = 100;
  // A submap that comes without a usable dead-reckoning edge is tied to its predecessor by the
  // dead-reckoned poses with these: it may be anywhere near, but not nowhere. So is the first to
  // the map, where there are position fixes and nothing says how well the start is known.
  double unlinked_sigma_m = 100.0;
  double unlinked_sigma_yaw_rad = Deg2Rad(30.0);

  std::string Validate() const;
};

// The most probable x, y, yaw of all submap frames and errors of mounting, given dead reckoning,
// loop closures and position fixes (section III-B of the paper, with a robust loss), their
// covariances, and what it thinks of each closure. Dead reckoning is believed (quadratic); closures
// and fixes must earn their weight in every solution anew, so that one refused earlier comes back
// when later evidence speaks for it.
//
// The solution depends on the graph alone, as far as its robust minimum is found whatever the way:
// batch and incremental give the same answer, though incremental goes on from the last one.
class PoseGraphOptimizer {
 public:
  explicit PoseGraphOptimizer(const OptimizerParams& params);

  // Takes the next version. One that it has is counted and left out; false: a version before this
  // one is missing, nothing is taken. Of a malformed update the usable rest is taken; what was
  // refused is counted by reason. A pair of submaps has one dead-reckoning edge and one loop
  // closure: a later edge takes the place of the earlier one (registered again, not twice).
  bool Add(const GraphUpdate& update);

  // True for a version that it has with other content: the sender has begun another graph.
  bool Contradicts(const GraphUpdate& update) const;

  // Solves for everything added. Vertices by rising id; every loop closure with its weight, 0 where
  // registration itself refused it.
  PoseGraph Solve();

  // How well the relative poses of these pairs are known under the last solution, exactly: those
  // whose vertices are in it, in their order. Nothing where vertices or edges came since, or the
  // covariance cannot be found. Costs a factor of the graph and a solve for each distinct b.
  std::vector<PairCovariance> RelativeCovariances(
      const std::vector<std::pair<SubmapId, SubmapId>>& pairs);

  // Those that pull, and those of them that the last solution believes.
  std::int64_t position_fixes() const;
  std::int64_t position_fixes_believed() const;

  std::int64_t version() const { return static_cast<std::int64_t>(fingerprints_.size()); }
  // Of everything refused or repeated, by reason; appears with the first count.
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

 private:
  struct Vertex {
    Pose2 dead_reckoned;
    double heading_sigma_rad;                              // 0: not known
    std::optional<Pose2> solved;                           // in the last solution
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // there
  };
  struct Edge {
    GraphEdge edge;
    SqrtInformation root;
    std::optional<double> weight;  // in the last solution
    double doubt = 0.0;            // there
    bool Pulls() const { return edge.verdict == LoopVerdict::kAccepted; }
  };
  using Pair = std::pair<SubmapId, SubmapId>;  // smaller id first

  void AddVertex(const GraphVertex& vertex);
  void AddEdge(const GraphEdge& edge);
  const char* WhyUnusable(const GraphEdge& edge) const;

  void SetMounting(const MountingSigmas& sigmas);
  bool SeeksMounting() const { return !mounting_.AreAllZero(); }
  // Of the submaps; the errors of mounting, where they are sought, come last.
  std::map<SubmapId, int> Numbering() const;
  // Position fixes and loop closures that pull, in the order of their factors, which come last.
  std::vector<Edge*> RobustEdges();
  FactorGraph MakeFactorGraph(const std::map<SubmapId, int>& number,
                              const std::vector<Edge*>& robust) const;
  void AddAnchor(const HeadingInformation& headings, FactorGraph* graph) const;
  void AddMounting(FactorGraph* graph) const;
  // The columns of errors of mounting that cannot be are zero.
  Eigen::Matrix3d OfThoseSought(const Eigen::Matrix3d& by_mounting) const;
  void AddDeadReckoning(const std::map<SubmapId, int>& number, FactorGraph* graph) const;
  HeadingInformation Headings() const;
  void AddHeadings(const HeadingInformation& headings, FactorGraph* graph) const;
  SolverStart Start(const FactorGraph& graph, const std::vector<Edge*>& robust) const;
  void Keep(const RobustSolution& solution,
            const FactorGraph& graph,
            const std::vector<Edge*>& robust);
  void FillCovariance(const std::optional<GraphCovariance>& covariance, PoseGraph* solution);

  OptimizerParams params_;
  double threshold_[4];                      // chi-square quantile by degrees of freedom
  std::vector<std::uint64_t> fingerprints_;  // of every version, from 1
  std::map<SubmapId, Vertex> vertices_;
  std::map<Pair, Edge> dead_reckoning_;
  std::map<Pair, Edge> loops_;
  std::optional<Edge> start_;
  std::vector<Edge> fixes_;
  MountingSigmas mounting_;
  Pose2 solved_mounting_;  // in the last solution
  // In the last solution, of plain factors by PlainKeys(): those in doubt.
  std::map<std::tuple<int, int, int>, double> doubts_;
  double scale_when_chosen_ = 1.0;
  std::int64_t solved_version_ = 0;
  std::map<std::string, std::int64_t> counters_;
};

}  // namespace seastitch
