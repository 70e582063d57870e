#include "optimizer/robust_solver.hpp"

#include <algorithm>
#include <cmath>

#include "optimizer/ceres_minimiser.hpp"
#include "optimizer/outlier_tests.hpp"

namespace seastitch {
namespace {

// Where every weight is still above zero: remark 5 of the paper that GraduatedLoss names.
double FirstMu(double worst_ratio) {
  const double mu = 1.0 / (2.0 * worst_ratio - 1.0);
  return mu > 0.0 ? std::min(mu, GraduatedLoss::kFinalMu) : GraduatedLoss::kFinalMu;
}

class RobustSolver {
 public:
  RobustSolver(const FactorGraph& graph, const SolverParams& params)
      : graph_(graph), minimiser_(graph), all_(graph.factors.size(), true), params_(params) {}

  RobustSolution FromDeadReckoning(const std::vector<Pose2>& dead_reckoned) {
    Graduate(dead_reckoned, all_, Losses::kIndependent);
    RobustSolution solution = Final();
    if (!solution.contradicted) return solution;
    const double effective_size = kEffectiveSize * VarianceFactor(graph_, solution.innovations);
    Graduate(dead_reckoned, NearDeadReckoning(dead_reckoned), effective_size);
    minimiser_.Minimise(FinalLosses(), params_.max_iterations, kForCost);
    return Cost(minimiser_.poses(), effective_size) < Cost(solution.T_map_vertex, effective_size)
               ? Final()
               : std::move(solution);
  }

  // Nothing where that will not do.
  std::optional<RobustSolution> FromLast(const SolverStart& start) {
    const bool has_grown = static_cast<double>(graph_.factors.size()) >=
                           kGrowth * static_cast<double>(start.judged_size);
    if (has_grown && start.contradicted) return std::nullopt;
    const std::vector<bool> accepted = Predicted(start);
    minimiser_.StartFrom(start.T_map_vertex);
    if (Accepted(minimiser_.Weights(FinalLosses())) != accepted)
      minimiser_.Minimise({{}, accepted}, 1, kNear);
    RobustSolution solution = Final();
    solution.from_dead_reckoning = false;
    if (!solution.converged || Accepted(solution.weights) != accepted ||
        (has_grown && solution.contradicted))
      return std::nullopt;
    return solution;
  }

 private:
  static std::vector<bool> Accepted(const std::vector<double>& weights) {
    std::vector<bool> accepted;
    for (const double weight : weights) accepted.push_back(weight >= kAcceptedWeight);
    return accepted;
  }

  // The verdict on each: that of the last solution; of what is new, whether it is within its gate
  // there.
  std::vector<bool> Predicted(const SolverStart& start) const {
    std::vector<double> weights;
    std::vector<std::size_t> is_new;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      weights.push_back(start.weights[k].value_or(0.0));
      if (!start.weights[k]) is_new.push_back(k);
    }
    std::vector<bool> accepted = Accepted(weights);
    for (const std::size_t k : WithinGate(is_new, start.T_map_vertex, weights)) accepted[k] = true;
    return accepted;
  }

  // An accepted factor fails the test of its innovation, at twice its threshold, beyond which an
  // honest one in millions is; or more is refused than chance refuses.
  bool IsContradicted(const RobustSolution& solution) const {
    const double of_step = kStepThreshold * VarianceFactor(graph_, solution.innovations);
    double robust = 0.0, refused = 0.0;
    for (std::size_t k = 0; k < solution.innovations.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      // A mounting further off than was thought is what is sought.
      if (factor.j == graph_.mounting_vertex) continue;
      const double threshold = factor.IsRobust() ? factor.loss.c2 : of_step;
      if (solution.weights[k] > 0.0 && solution.innovations[k] > 2.0 * threshold) return true;
      robust += factor.IsRobust() ? 1.0 : 0.0;
      refused += solution.weights[k] == 0.0 ? 1.0 : 0.0;
    }
    return refused > 2.0 * (1.0 - params_.inlier_probability) * robust;
  }

  // From dead reckoning to near the minimum of the squares of the active set, and on to the robust
  // minimum of all, each for itself: how groups count is for finding it alone.
  void Graduate(const std::vector<Pose2>& dead_reckoned,
                const std::vector<bool>& active,
                double effective_size) {
    Losses losses{{}, active, effective_size};
    minimiser_.StartFrom(dead_reckoned);
    minimiser_.Minimise(losses, kStepsForSquares, kNear);
    for (double mu = FirstMu(WorstRatio(active)); mu < GraduatedLoss::kFinalMu;
         mu *= params_.graduation_step) {
      losses.mu = mu;
      minimiser_.Minimise(losses, kStepsAStage, kNear);
    }
    minimiser_.Minimise(FinalLosses(effective_size), kStepsAStage, kNear);
  }

  // To the robust minimum from where the minimiser stands.
  RobustSolution Final() {
    RobustSolution solution;
    solution.converged = minimiser_.Minimise(FinalLosses(), params_.max_iterations, kFine);
    solution.T_map_vertex = minimiser_.poses();
    solution.weights = minimiser_.Weights(FinalLosses());
    solution.covariance = GraphCovariance::At(graph_, solution.T_map_vertex, solution.weights);
    if (!solution.covariance) return solution;
    solution.selected = solution.covariance->MarginalsAndResiduals();
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      solution.innovations.push_back(
          NormalisedInnovation(Residual(graph_, graph_.factors[k], solution.T_map_vertex),
                               solution.selected.of_residual[k],
                               solution.weights[k]));
    solution.contradicted = IsContradicted(solution);
    return solution;
  }

  // The largest squared residual of those that are active, in units of its threshold.
  double WorstRatio(const std::vector<bool>& active) const {
    const std::vector<Pose2> poses = minimiser_.poses();
    double worst = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      if (active[k])
        worst = std::max(
            worst,
            Residual(graph_, graph_.factors[k], poses).squaredNorm() / graph_.factors[k].loss.c2);
    return worst;
  }

  // For the choice between two: a step of dead reckoning that many groups contradict is at fault,
  // however far off.
  double Cost(const std::vector<Pose2>& poses, double effective_size) const {
    const Losses losses = FinalLosses(effective_size);
    double cost = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      const double s = Residual(graph_, factor, poses).squaredNorm();
      const double value = losses.Value(factor, k, s);
      const bool is_plain_step = factor.i != kMap && !factor.IsRobust();
      cost += is_plain_step ? std::min(value, kFault) : value;
    }
    return cost;
  }

  // Of these factors, of no weight, those whose normalised innovation is within its chi-square
  // gate.
  std::vector<std::size_t> WithinGate(const std::vector<std::size_t>& factors,
                                      const std::vector<Pose2>& poses,
                                      const std::vector<double>& weights) const {
    std::vector<std::size_t> within;
    if (factors.empty()) return within;
    const auto covariance = GraphCovariance::At(graph_, poses, weights);
    if (!covariance) return within;
    GraphCovariance::Pairs pairs(*covariance);
    for (const std::size_t k : factors) {
      const Factor& factor = graph_.factors[k];
      const Eigen::Vector3d residual = Residual(graph_, factor, poses);
      if (NormalisedInnovation(residual, covariance->OfResidual(k, pairs), 0.0) < factor.loss.c2)
        within.push_back(k);
    }
    return within;
  }

  std::vector<bool> NearDeadReckoning(const std::vector<Pose2>& dead_reckoned) const {
    std::vector<double> weights;
    std::vector<std::size_t> robust;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      weights.push_back(graph_.factors[k].IsRobust() ? 0.0 : 1.0);
      if (graph_.factors[k].IsRobust()) robust.push_back(k);
    }
    std::vector<bool> near(weights.size(), false);
    for (const std::size_t k : WithinGate(robust, dead_reckoned, weights)) near[k] = true;
    return near;
  }

  Losses FinalLosses(double effective_size = Losses::kIndependent) const {
    return {GraduatedLoss::kFinalMu, all_, effective_size};
  }

  static constexpr double kEffectiveSize = 2.0;  // where dead reckoning is as good as it states
  static constexpr double kFault = 80.0;         // two and a half groups, where these count as two
  static constexpr double kStepThreshold = 16.27;  // 0.999 of chi-square, 3 degrees of freedom
  static constexpr double kGrowth = 1.02;
  // Of Minimise(): to go on from, to compare costs, of an answer.
  static constexpr double kNear = 1e-3;
  static constexpr double kForCost = 1e-6;
  static constexpr double kFine = 1e-8;
  static constexpr int kStepsForSquares = 3;
  static constexpr int kStepsAStage = 2;

  const FactorGraph& graph_;
  CeresMinimiser minimiser_;
  const std::vector<bool> all_;
  const SolverParams params_;
};

}  // namespace

bool RobustSolution::IsFinite() const {
  return std::all_of(T_map_vertex.begin(), T_map_vertex.end(), [](const Pose2& pose) {
    return pose.Vector().allFinite();
  });
}

RobustSolution SolveFromDeadReckoning(const FactorGraph& graph,
                                      const std::vector<Pose2>& dead_reckoned,
                                      const SolverParams& params) {
  return RobustSolver(graph, params).FromDeadReckoning(dead_reckoned);
}

RobustSolution SolveFromLast(const FactorGraph& graph,
                             const SolverStart& start,
                             const SolverParams& params) {
  RobustSolver solver(graph, params);
  if (start.T_map_vertex.empty()) return solver.FromDeadReckoning(start.dead_reckoned);
  if (auto solution = solver.FromLast(start)) return *std::move(solution);
  return solver.FromDeadReckoning(start.dead_reckoned);
}

}  // namespace seastitch
