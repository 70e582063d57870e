#include "optimizer/pose_graph_optimizer.hpp"

#include <algorithm>

#include "optimizer/graph_builder.hpp"
#include "optimizer/robust_solver.hpp"

namespace seastitch {

std::map<std::string, std::int64_t> PoseGraphOptimizer::counters() const {
  std::map<std::string, std::int64_t> all = failures_;
  all.insert(store_.counters().begin(), store_.counters().end());
  return all;
}

std::int64_t PoseGraphOptimizer::position_fixes() const {
  const auto& fixes = store_.fixes();
  return std::count_if(
      fixes.begin(), fixes.end(), [](const StoredEdge& fix) { return fix.Pulls(); });
}

std::int64_t PoseGraphOptimizer::position_fixes_believed() const {
  const auto& fixes = store_.fixes();
  return std::count_if(fixes.begin(), fixes.end(), [](const StoredEdge& fix) {
    return fix.weight.value_or(0.0) >= kBelievedWeight;
  });
}

std::vector<Pose2> PoseGraphOptimizer::DeadReckoned() const {
  std::vector<Pose2> poses;
  for (const auto& [id, vertex] : store_.vertices()) poses.push_back(vertex.dead_reckoned);
  if (store_.EstimatesMounting()) poses.emplace_back();
  return poses;
}

// The last solution, new vertices where dead reckoning goes on from it. Empty: there is none.
std::vector<Pose2> PoseGraphOptimizer::Predicted() const {
  std::vector<Pose2> poses;
  if (!store_.vertices().begin()->second.solved) return poses;
  Pose2 before;
  for (const auto& [id, vertex] : store_.vertices()) {
    poses.push_back(vertex.solved ? *vertex.solved
                                  : poses.back() * (Inverse(before) * vertex.dead_reckoned));
    before = vertex.dead_reckoned;
  }
  if (store_.EstimatesMounting()) poses.push_back(solved_mounting_);
  return poses;
}

// Robust factors come last.
std::vector<std::optional<double>> PoseGraphOptimizer::LastWeights(std::size_t num_factors) const {
  const std::vector<const StoredEdge*> robust = store_.RobustEdges();
  std::vector<std::optional<double>> weights(num_factors - robust.size(), 1.0);
  for (const StoredEdge* edge : robust) weights.push_back(edge->weight);
  return weights;
}

std::optional<PoseGraph> PoseGraphOptimizer::Solve(SolveStart start) {
  if (store_.vertices().empty()) return PoseGraph{version(), {}, {}, {}};
  const FactorGraph graph = BuildFactorGraph(store_, params_);
  const SolverParams params{
      params_.graduation_step, params_.max_iterations, params_.inlier_probability};
  const RobustSolution solution = start == SolveStart::kFromDeadReckoning
                                      ? SolveFromDeadReckoning(graph, DeadReckoned(), params)
                                      : SolveFromLast(graph,
                                                      {DeadReckoned(),
                                                       Predicted(),
                                                       LastWeights(graph.factors.size()),
                                                       contradicted_,
                                                       judged_size_},
                                                      params);
  contradicted_ = solution.contradicted;
  if (solution.from_dead_reckoning) judged_size_ = graph.factors.size();
  converged_ = solution.converged;
  if (!converged_) ++failures_["solves_not_converged"];
  if (!solution.IsFinite()) {
    ++failures_["solutions_not_finite"];
    return std::nullopt;
  }
  return Published(solution);
}

PoseGraph PoseGraphOptimizer::Published(const RobustSolution& solution) {
  const std::size_t num_robust = store_.RobustEdges().size();
  store_.KeepSolution(
      solution.T_map_vertex,
      {solution.weights.end() - static_cast<std::ptrdiff_t>(num_robust), solution.weights.end()});
  solved_version_ = version();
  if (!solution.covariance) ++failures_["covariance_failed"];
  const Eigen::Matrix3d unknown =
      Eigen::Vector3d(
          params_.unlinked_sigma_m, params_.unlinked_sigma_m, params_.unlinked_sigma_yaw_rad)
          .cwiseAbs2()
          .asDiagonal();
  PoseGraph out;
  out.graph_version = version();
  std::vector<Eigen::Matrix3d> with_newest;
  if (solution.covariance)
    with_newest = solution.covariance->WithVertex(static_cast<int>(store_.vertices().size()) - 1);
  for (const auto& [id, vertex] : store_.vertices()) {
    const std::size_t k = out.vertices.size();
    SolvedVertex& solved = out.vertices.emplace_back();
    solved.id = id;
    solved.T_map_level = {vertex.solved->x, vertex.solved->y, WrapAngle(vertex.solved->yaw)};
    solved.covariance = solution.covariance ? solution.selected.marginal[k] : unknown;
    if (solution.covariance) solved.covariance_with_newest = with_newest[k];
  }
  for (const auto& [pair, loop] : store_.loops())
    out.loop_edges.push_back({loop.edge.from, loop.edge.to, loop.weight.value_or(0.0)});
  if (!store_.EstimatesMounting()) return out;
  solved_mounting_ = solution.T_map_vertex.back();
  out.mounting.sonar_m = solved_mounting_.Translation();
  out.mounting.dvl_yaw_rad = solved_mounting_.yaw;
  const MountingSigmas& sigmas = store_.mounting();
  const Eigen::Matrix3d before = sigmas.Vector().cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d after = solution.covariance ? solution.selected.marginal.back() : before;
  out.mounting.covariance = EstimatedColumns(EstimatedColumns(after, sigmas).transpose(), sigmas);
  return out;
}

std::vector<PairCovariance> PoseGraphOptimizer::RelativeCovariances(
    const std::vector<std::pair<SubmapId, SubmapId>>& pairs) const {
  if (solved_version_ != version() || store_.vertices().empty()) return {};
  const FactorGraph graph = BuildFactorGraph(store_, params_);
  const std::vector<Pose2> poses = Predicted();
  std::vector<double> weights;
  for (const auto& weight : LastWeights(graph.factors.size()))
    weights.push_back(weight.value_or(0.0));
  const auto covariance = GraphCovariance::At(graph, poses, weights);
  if (!covariance) return {};

  const std::map<SubmapId, int> number = VertexNumbers(store_);
  GraphCovariance::Pairs between(*covariance);
  std::vector<PairCovariance> out;
  for (const auto& [a, b] : pairs) {
    if (a == b || !number.contains(a) || !number.contains(b)) continue;
    const int i = number.at(a), j = number.at(b);
    out.push_back({a,
                   b,
                   RelativeCovariance(poses[static_cast<std::size_t>(i)],
                                      poses[static_cast<std::size_t>(j)],
                                      between(i, i),
                                      between(j, j),
                                      between(i, j))});
  }
  return out;
}

}  // namespace seastitch
