#include "optimizer/solver/robust_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/graph.hpp"
#include "optimizer/solver/ceres_minimiser.hpp"
#include "optimizer/solver/outlier_tests.hpp"

namespace seastitch {
namespace {

// Effective sample size that counts every factor as independent.
constexpr double kIndependent = std::numeric_limits<double>::infinity();
constexpr double kEffectiveSize = 2.0;    // where dead reckoning's covariance is consistent
constexpr double kFault = 80.0;           // the cost of two and a half groups of size two
constexpr double kStepThreshold = 16.27;  // 0.999 of chi-square, 3 degrees of freedom
constexpr double kGrowth = 1.02;
// Tolerances of the minimiser: between stages, for comparing costs, for a solution during the dive,
// and for one from dead reckoning.
constexpr double kNear = 1e-3;
constexpr double kForCost = 1e-6;
constexpr double kOnTheWay = 1e-7;
constexpr double kFine = 1e-8;
constexpr int kStepsForSquares = 3;
constexpr int kStepsAStage = 2;

class RobustSolver {
 public:
  RobustSolver(const FactorGraph& graph,
               const OptimizerParams& params,
               const std::function<void()>& on_step)
      : graph_(graph), minimiser_(graph, on_step), params_(params) {}

  RobustSolution FromDeadReckoning(const std::vector<Pose2>& dead_reckoned) {
    const std::vector<bool> all(graph_.factors.size(), true);
    RobustSolution solution = Final(Graduate(dead_reckoned, all, kIndependent), kFine);
    if (!solution.contradicted) return solution;
    const double effective_size = kEffectiveSize * VarianceFactor(graph_, solution.innovations);
    std::vector<double> of_steps;
    for (const Factor& factor : graph_.factors) of_steps.push_back(factor.IsRobust() ? 0.0 : 1.0);
    std::vector<Pose2> poses =
        Graduate(dead_reckoned, WithinGate(dead_reckoned, of_steps), effective_size);
    minimiser_.Minimise(FinalLosses(effective_size), kStepsAStage, kNear, &poses);
    minimiser_.Minimise(FinalLosses(kIndependent), params_.max_iterations, kForCost, &poses);
    return Cost(poses, effective_size) < Cost(solution.T_map_vertex, effective_size)
               ? Final(std::move(poses), kFine)
               : std::move(solution);
  }

  // Absent: the graph has to be solved from dead reckoning.
  std::optional<RobustSolution> FromLast(const SolverStart& start) {
    const bool has_grown = static_cast<double>(graph_.factors.size()) >=
                           kGrowth * static_cast<double>(start.judged_size);
    if (has_grown && start.contradicted) return std::nullopt;
    const std::vector<bool> accepted = Predicted(start);
    std::vector<Pose2> poses = start.T_map_vertex;
    if (Accepted(WeightsAt(poses)) != accepted)
      minimiser_.Minimise({{}, Shares(accepted, kIndependent)}, 1, kNear, &poses);
    RobustSolution solution = Final(std::move(poses), kOnTheWay);
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

  // Whether each factor is an inlier: as in the last solution, and for a new factor, whether it is
  // within its gate there.
  std::vector<bool> Predicted(const SolverStart& start) const {
    std::vector<double> weights;
    bool all_known = true;
    for (std::size_t k = 0; k < start.weights.size(); ++k) {
      weights.push_back(start.weights[k].value_or(0.0));
      all_known = all_known && (start.weights[k] || start.innovations[k]);
    }
    std::vector<bool> accepted = Accepted(weights);
    const std::vector<bool> within = all_known ? accepted : WithinGate(start.T_map_vertex, weights);
    for (std::size_t k = 0; k < accepted.size(); ++k) {
      if (start.weights[k]) continue;
      const std::optional<double>& innovation = start.innovations[k];
      accepted[k] = innovation ? *innovation < graph_.factors[k].loss.c2 : within[k];
    }
    return accepted;
  }

  // For robust factors, all of weight 0 here: whether the normalised innovation is within the
  // chi-square gate. True for all others.
  std::vector<bool> WithinGate(const std::vector<Pose2>& poses,
                               const std::vector<double>& weights) const {
    std::vector<bool> within(weights.size(), true);
    const auto covariance = GraphCovariance::At(graph_, poses, weights);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      if (!factor.IsRobust()) continue;
      within[k] = covariance &&
                  NormalisedInnovation(Residual(factor, poses), covariance->of_residual()[k], 0.0) <
                      factor.loss.c2;
    }
    return within;
  }

  // True where a factor with a weight fails the test of its innovation, or where more factors have
  // weight 0 than by chance. The test's threshold is twice the gate: one consistent factor in
  // millions exceeds it.
  bool IsContradicted(const RobustSolution& solution) const {
    const double of_step = kStepThreshold * VarianceFactor(graph_, solution.innovations);
    double robust = 0.0, refused = 0.0;
    for (std::size_t k = 0; k < solution.innovations.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      // A mounting error beyond its prior is a result, no contradiction.
      if (graph_.IsMounting(factor.j)) continue;
      const double threshold = factor.IsRobust() ? factor.loss.c2 : of_step;
      if (solution.weights[k] > 0.0 && solution.innovations[k] > 2.0 * threshold) return true;
      robust += factor.IsRobust() ? 1.0 : 0.0;
      refused += solution.weights[k] == 0.0 ? 1.0 : 0.0;
    }
    return refused > 2.0 * (1.0 - params_.inlier_probability) * robust;
  }

  // Graduated non-convexity with the active factors: first towards the least-squares minimum, then
  // towards the robust one. effective_size only helps to find a good minimum.
  std::vector<Pose2> Graduate(std::vector<Pose2> poses,
                              const std::vector<bool>& active,
                              double effective_size) {
    Losses losses{{}, Shares(active, effective_size)};
    minimiser_.Minimise(losses, kStepsForSquares, kNear, &poses);
    for (double mu = FirstMu(poses, active); mu < GraduatedLoss::kFinalMu;
         mu *= params_.graduation_step) {
      losses.mu = mu;
      minimiser_.Minimise(losses, kStepsAStage, kNear, &poses);
    }
    return poses;
  }

  // The largest mu at which every weight is still above zero: remark 5 of the paper that
  // GraduatedLoss cites.
  double FirstMu(const std::vector<Pose2>& poses, const std::vector<bool>& active) const {
    double worst = 0.0;  // squared residual, in units of its threshold
    for (std::size_t k = 0; k < graph_.factors.size(); ++k)
      if (active[k])
        worst = std::max(
            worst, Residual(graph_.factors[k], poses).squaredNorm() / graph_.factors[k].loss.c2);
    const double mu = 1.0 / (2.0 * worst - 1.0);
    return mu > 0.0 ? std::min(mu, GraduatedLoss::kFinalMu) : GraduatedLoss::kFinalMu;
  }

  // The robust minimum near these poses.
  RobustSolution Final(std::vector<Pose2> poses, double tolerance) {
    RobustSolution solution;
    solution.converged =
        minimiser_.Minimise(FinalLosses(kIndependent), params_.max_iterations, tolerance, &poses);
    solution.weights = WeightsAt(poses);
    solution.covariance = GraphCovariance::At(graph_, poses, solution.weights);
    for (std::size_t k = 0; solution.covariance && k < graph_.factors.size(); ++k)
      solution.innovations.push_back(NormalisedInnovation(Residual(graph_.factors[k], poses),
                                                          solution.covariance->of_residual()[k],
                                                          solution.weights[k]));
    solution.contradicted = !solution.covariance || IsContradicted(solution);
    solution.T_map_vertex = std::move(poses);
    return solution;
  }

  // Cost by which two solutions are compared. The cost of a dead-reckoning factor is bounded: where
  // many groups contradict it, it is the factor that is wrong, however large its error.
  double Cost(const std::vector<Pose2>& poses, double effective_size) const {
    const Losses losses = FinalLosses(effective_size);
    double cost = 0.0;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      const double s = Residual(factor, poses).squaredNorm();
      const double value = losses.Value(factor, k, s);
      cost += factor.is_dead_reckoning ? std::min(value, kFault) : value;
    }
    return cost;
  }

  std::vector<double> WeightsAt(const std::vector<Pose2>& poses) const {
    const Losses losses = FinalLosses(kIndependent);
    std::vector<double> weights;
    for (std::size_t k = 0; k < graph_.factors.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      const double s = Residual(factor, poses).squaredNorm();
      weights.push_back(losses.Weight(factor, k, s));
    }
    return weights;
  }

  Losses FinalLosses(double effective_size) const {
    const std::vector<bool> all(graph_.factors.size(), true);
    return {GraduatedLoss::kFinalMu, Shares(all, effective_size)};
  }

  // Fraction of each factor's information that is used. A correlated group counts as at most
  // effective_size independent factors; a robust factor that is not active as none.
  std::vector<double> Shares(const std::vector<bool>& active, double effective_size) const {
    std::vector<double> shares;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const Factor& factor = graph_.factors[k];
      const double share = active[k] ? std::min(1.0, effective_size / factor.group_size) : 0.0;
      shares.push_back(factor.IsRobust() ? share : 1.0);
    }
    return shares;
  }

  const FactorGraph& graph_;
  CeresMinimiser minimiser_;
  const OptimizerParams params_;
};

}  // namespace

bool RobustSolution::IsFinite() const {
  return std::all_of(T_map_vertex.begin(), T_map_vertex.end(), [](const Pose2& pose) {
    return pose.Vector().allFinite();
  });
}

RobustSolution SolveRobustly(const FactorGraph& graph,
                             const SolverStart& start,
                             const OptimizerParams& params,
                             const std::function<void()>& on_step) {
  RobustSolver solver(graph, params, on_step);
  if (!start.T_map_vertex.empty())
    if (auto solution = solver.FromLast(start)) return *std::move(solution);
  return solver.FromDeadReckoning(start.dead_reckoned);
}

}  // namespace seastitch
