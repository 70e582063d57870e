#include "optimizer/pose_graph_optimizer.hpp"

#include <algorithm>
#include <utility>

#include "optimizer/solver/closure_prior.hpp"
#include "optimizer/solver/graph_builder.hpp"
#include "optimizer/solver/robust_solver.hpp"

namespace seastitch {

std::map<std::string, std::int64_t> PoseGraphOptimizer::counters() const {
  std::map<std::string, std::int64_t> all = failures_;
  all.insert(store_.counters().begin(), store_.counters().end());
  return all;
}

bool PoseGraphOptimizer::Add(const GraphUpdate& update) {
  const std::int64_t before = version();
  if (!store_.Add(update)) return false;
  if (version() == before) return true;  // a repetition
  is_due_ = is_due_ || update.final || update.resumed ||
            IsSolutionDue(store_.vertices().size(), solved_number_.size()) || HasSurprise(update);
  return true;
}

LastSolution PoseGraphOptimizer::Last() const {
  return {store_, solved_number_, solved_mounting_, covariance_};
}

bool PoseGraphOptimizer::HasSurprise(const GraphUpdate& update) const {
  return std::any_of(update.edges.begin(), update.edges.end(), [&](const GraphEdge& edge) {
    if (edge.kind != EdgeKind::kLoopClosure) return false;
    const auto stored = store_.loops().find(std::minmax(edge.from, edge.to));
    return stored != store_.loops().end() && stored->second.Pulls() && !stored->second.weight &&
           IsBeyondPrior(stored->second, Last());
  });
}

std::vector<Pose2> PoseGraphOptimizer::DeadReckoned() const {
  std::vector<Pose2> poses;
  for (const auto& [id, vertex] : store_.vertices()) poses.push_back(vertex.dead_reckoned);
  poses.resize(poses.size() + store_.mounting().size());
  return poses;
}

// The last solution. New vertices are extrapolated from it by dead reckoning; those of a new chain
// are dead reckoned. Empty: there is no last solution.
std::vector<Pose2> PoseGraphOptimizer::Predicted() const {
  std::vector<Pose2> poses;
  if (!store_.vertices().begin()->second.solved) return poses;
  const StoredVertex* before = nullptr;
  for (const auto& [id, vertex] : store_.vertices()) {
    if (vertex.solved)
      poses.push_back(*vertex.solved);
    else if (before == nullptr || before->chain != vertex.chain)
      poses.push_back(vertex.dead_reckoned);
    else
      poses.push_back(poses.back() * (Inverse(before->dead_reckoned) * vertex.dead_reckoned));
    before = &vertex;
  }
  for (const auto& [chain, sigmas] : store_.mounting()) {
    const auto solved = solved_mounting_.find(chain);
    poses.push_back(solved == solved_mounting_.end() ? Pose2{} : solved->second);
  }
  return poses;
}

// Inlier weight of each factor in the last solution; absent where it is new. Robust factors come
// last.
std::vector<std::optional<double>> PoseGraphOptimizer::LastWeights(std::size_t num_factors) const {
  const std::vector<const StoredEdge*> robust = store_.RobustEdges();
  std::vector<std::optional<double>> weights(num_factors - robust.size(), 1.0);
  for (const StoredEdge* edge : robust) weights.push_back(edge->weight);
  return weights;
}

// Of the loop closures that are not in the last solution.
std::vector<std::optional<double>> PoseGraphOptimizer::NewInnovations(
    std::size_t num_factors) const {
  const std::vector<const StoredEdge*> robust = store_.RobustEdges();
  std::vector<std::optional<double>> innovations(num_factors - robust.size());
  for (const StoredEdge* edge : robust) {
    const bool is_new = !edge->weight && edge->edge.kind == EdgeKind::kLoopClosure;
    innovations.push_back(is_new ? InnovationOf(*edge, Last()) : std::nullopt);
  }
  return innovations;
}

std::optional<PoseGraph> PoseGraphOptimizer::Solve(SolveStart start,
                                                   const std::function<void()>& on_step) {
  is_due_ = false;
  if (store_.vertices().empty()) return PoseGraph{version(), {}, {}, {}};
  const FactorGraph graph = BuildFactorGraph(store_, params_);
  SolverStart from{
      .dead_reckoned = DeadReckoned(), .contradicted = contradicted_, .judged_size = judged_size_};
  if (start == SolveStart::kWarm) {
    from.T_map_vertex = Predicted();
    from.weights = LastWeights(graph.factors.size());
    from.innovations = NewInnovations(graph.factors.size());
  }
  RobustSolution solution = SolveRobustly(graph, from, params_, on_step);
  contradicted_ = solution.contradicted;
  if (solution.from_dead_reckoning) judged_size_ = graph.factors.size();
  converged_ = solution.converged;
  if (!converged_) ++failures_["solves_not_converged"];
  if (!solution.IsFinite()) {
    ++failures_["solutions_not_finite"];
    return std::nullopt;
  }
  covariance_ = std::move(solution.covariance);
  if (!covariance_) ++failures_["covariance_failed"];
  const auto num_robust = static_cast<std::ptrdiff_t>(store_.RobustEdges().size());
  store_.KeepSolution(solution.T_map_vertex,
                      {solution.weights.end() - num_robust, solution.weights.end()});
  std::size_t vertex = store_.vertices().size();
  for (const auto& [chain, sigmas] : store_.mounting())
    solved_mounting_[chain] = solution.T_map_vertex[vertex++];
  solved_version_ = version();
  solved_number_ = VertexNumbers(store_);
  return Published();
}

PoseGraph PoseGraphOptimizer::Published() const {
  const Eigen::Matrix3d unknown =
      Eigen::Vector3d(
          params_.unlinked_sigma_m, params_.unlinked_sigma_m, params_.unlinked_sigma_yaw_rad)
          .cwiseAbs2()
          .asDiagonal();
  PoseGraph out;
  out.graph_version = version();
  std::vector<Eigen::Matrix3d> with_newest;
  if (covariance_)
    with_newest = covariance_->WithVertex(static_cast<int>(store_.vertices().size()) - 1);
  for (const auto& [id, vertex] : store_.vertices()) {
    const std::size_t k = out.vertices.size();
    SolvedVertex& solved = out.vertices.emplace_back();
    solved.id = id;
    solved.T_map_level = {vertex.solved->x, vertex.solved->y, WrapAngle(vertex.solved->yaw)};
    solved.covariance = covariance_ ? covariance_->marginal()[k] : unknown;
    if (covariance_) solved.covariance_with_newest = with_newest[k];
  }
  for (const auto& [pair, loop] : store_.loops())
    out.loop_edges.push_back({loop.edge.from, loop.edge.to, loop.weight.value_or(0.0)});
  for (const auto& [chain, sigmas] : store_.mounting()) {
    const std::size_t k = store_.vertices().size() + out.mounting.size();
    const Eigen::Matrix3d before = sigmas.Vector().cwiseAbs2().asDiagonal();
    const Eigen::Matrix3d after = covariance_ ? covariance_->marginal()[k] : before;
    const Pose2& solved = solved_mounting_.at(chain);
    out.mounting[chain] = {solved.Translation(),
                           solved.yaw,
                           EstimatedColumns(EstimatedColumns(after, sigmas).transpose(), sigmas)};
  }
  return out;
}

std::vector<PairCovariance> PoseGraphOptimizer::RelativeCovariances(
    const std::vector<std::pair<SubmapId, SubmapId>>& pairs) const {
  std::vector<PairCovariance> out;
  if (!covariance_) return out;
  const std::map<SubmapId, int>& number = solved_number_;
  GraphCovariance::Pairs between(*covariance_);
  for (const auto& [a, b] : pairs) {
    if (a == b || !number.contains(a) || !number.contains(b)) continue;
    const int i = number.at(a), j = number.at(b);
    const Eigen::Matrix3d covariance = RelativeCovariance(*store_.vertices().at(a).solved,
                                                          *store_.vertices().at(b).solved,
                                                          between(i, i),
                                                          between(j, j),
                                                          between(i, j));
    // After a gap of days it is a small difference of large numbers, and not exact.
    if (covariance.diagonal().minCoeff() < 0.0) continue;
    out.push_back({a, b, 0.5 * (covariance + covariance.transpose())});
  }
  return out;
}

}  // namespace seastitch
