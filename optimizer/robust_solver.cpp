#include "optimizer/robust_solver.hpp"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace seastitch {
namespace {

using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Block = std::array<double, 3>;

Pose2 ToPose(const double* block) { return {block[0], block[1], block[2]}; }

void Store(const Eigen::Matrix3d& J, double* out) {
  if (out == nullptr) return;
  Eigen::Map<RowMajor3d> rows(out);
  rows = J;
}

class BetweenCost final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  explicit BetweenCost(const RelativePoseCost& cost) : cost_(cost) {}
  bool Evaluate(const double* const* blocks, double* residual, double** jacobians) const override {
    Eigen::Matrix3d J_i, J_j;
    Eigen::Map<Eigen::Vector3d> r(residual);
    const bool wanted = jacobians != nullptr;
    r = cost_.Evaluate(
        ToPose(blocks[0]), ToPose(blocks[1]), wanted ? &J_i : nullptr, wanted ? &J_j : nullptr);
    if (wanted) Store(J_i, jacobians[0]);
    if (wanted) Store(J_j, jacobians[1]);
    return true;
  }

 private:
  const RelativePoseCost& cost_;
};

class InMapCost final : public ceres::SizedCostFunction<3, 3> {
 public:
  explicit InMapCost(const RelativePoseCost& cost) : cost_(cost) {}
  bool Evaluate(const double* const* blocks, double* residual, double** jacobians) const override {
    Eigen::Matrix3d J_j;
    Eigen::Map<Eigen::Vector3d> r(residual);
    r = cost_.Evaluate(Pose2{}, ToPose(blocks[0]), nullptr, &J_j);
    if (jacobians != nullptr) Store(J_j, jacobians[0]);
    return true;
  }

 private:
  const RelativePoseCost& cost_;
};

// What the robust losses, all together, are at the moment.
struct Stage {
  enum class Shape {
    kSquares,    // s
    kGraduated,  // GraduatedLoss at mu
    kHeld,       // s times a weight of the factor's own
  };
  Shape shape = Shape::kSquares;
  double mu = GraduatedLoss::kFinalMu;
};

enum class Accuracy {
  kRough,    // enough to go on to the next stage from
  kSettled,  // enough to read weights from
  kExact,    // to the last digits
};

class CeresLoss final : public ceres::LossFunction {
 public:
  CeresLoss(const GraduatedLoss& loss, const Stage* stage) : loss_(loss), stage_(stage) {}
  void Hold(double weight) { held_ = weight; }
  void Switch(bool on) { on_ = on; }

  void Evaluate(double s, double rho[3]) const override {
    rho[0] = on_ ? Value(s) : 0.0;
    rho[1] = on_ ? Weight(s) : 0.0;
    rho[2] = 0.0;  // re-weighted least squares: Ceres ignores a negative second derivative anyway
  }

 private:
  double Value(double s) const {
    switch (stage_->shape) {
      case Stage::Shape::kSquares: return s;
      case Stage::Shape::kGraduated: return loss_.Value(s, stage_->mu);
      case Stage::Shape::kHeld: break;
    }
    return held_ * s;
  }
  double Weight(double s) const {
    switch (stage_->shape) {
      case Stage::Shape::kSquares: return 1.0;
      case Stage::Shape::kGraduated: return loss_.Weight(s, stage_->mu);
      case Stage::Shape::kHeld: break;
    }
    return held_;
  }

  const GraduatedLoss loss_;
  const Stage* stage_;
  double held_ = 1.0;
  bool on_ = true;
};

ceres::Problem::Options BorrowedLosses() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

// The Ceres problem of a graph, kept through all stages.
class RobustProblem {
 public:
  RobustProblem(const FactorGraph& graph, const std::vector<Pose2>& start)
      : problem_(BorrowedLosses()) {
    for (const Pose2& pose : start) blocks_.push_back({pose.x, pose.y, pose.yaw});
    for (Block& block : blocks_) problem_.AddParameterBlock(block.data(), 3);
    if (graph.fixed_vertex >= 0) problem_.SetParameterBlockConstant(BlockOf(graph.fixed_vertex));
    for (const Factor& factor : graph.factors) AddFactor(factor);
  }

  bool Solve(const Stage& stage, Accuracy accuracy, int max_iterations) {
    stage_ = stage;
    ceres::Solver::Summary summary;
    ceres::Solve(Options(accuracy, max_iterations), &problem_, &summary);
    radius_ =
        summary.iterations.empty() ? kGaussNewton : summary.iterations.back().trust_region_radius;
    return summary.termination_type == ceres::CONVERGENCE;
  }

  // weights: one a factor of the graph; counts in Stage::Shape::kHeld.
  void Hold(const std::vector<double>& weights) {
    for (std::size_t k = 0; k < weights.size(); ++k)
      if (losses_[k]) losses_[k]->Hold(weights[k]);
  }

  // Switches robust factors on and off; plain squares always pull.
  void Switch(const std::vector<bool>& on) {
    for (std::size_t k = 0; k < on.size(); ++k)
      if (losses_[k]) losses_[k]->Switch(on[k]);
  }

  std::vector<Pose2> poses() const {
    std::vector<Pose2> poses;
    for (const Block& block : blocks_) poses.push_back(ToPose(block.data()));
    return poses;
  }

 private:
  double* BlockOf(int vertex) { return blocks_[static_cast<std::size_t>(vertex)].data(); }

  void AddFactor(const Factor& factor) {
    losses_.push_back(std::isfinite(factor.loss.c2)
                          ? std::make_unique<CeresLoss>(factor.loss, &stage_)
                          : nullptr);
    CeresLoss* loss = losses_.back().get();
    if (factor.i == kMap)
      problem_.AddResidualBlock(new InMapCost(factor.cost), loss, BlockOf(factor.j));
    else
      problem_.AddResidualBlock(
          new BetweenCost(factor.cost), loss, BlockOf(factor.i), BlockOf(factor.j));
  }

  static double FunctionTolerance(Accuracy accuracy) {
    switch (accuracy) {
      case Accuracy::kRough: return 1e-3;
      case Accuracy::kSettled: return 1e-6;
      case Accuracy::kExact: break;
    }
    return 1e-13;
  }

  ceres::Solver::Options Options(Accuracy accuracy, int max_iterations) const {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    // Eigen's factorisation calls no BLAS: same bytes whatever BLAS is installed, on any core
    // count.
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.num_threads = 1;
    options.max_num_iterations = max_iterations;
    options.initial_trust_region_radius = radius_;
    options.max_trust_region_radius = kGaussNewton;
    options.function_tolerance = FunctionTolerance(accuracy);
    options.parameter_tolerance = 1e-12;
    options.gradient_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    return options;
  }

  // So large that the first step is the full one of Gauss and Newton. The region shrinks only where
  // that fails, and the next stage goes on with what the last one learnt.
  static constexpr double kGaussNewton = 1e14;

  double radius_ = kGaussNewton;
  std::vector<Block> blocks_;
  std::vector<std::unique_ptr<CeresLoss>> losses_;  // one a factor; null: plain squares
  Stage stage_;
  ceres::Problem problem_;
};

double SquaredResidual(const Factor& factor, const std::vector<Pose2>& poses) {
  return Residual(factor, poses).squaredNorm();
}

// The largest squared residual in units of its threshold, of the factors that are on.
double WorstRatio(const FactorGraph& graph,
                  const std::vector<bool>& on,
                  const std::vector<Pose2>& poses) {
  double worst = 0.0;
  for (std::size_t k = 0; k < on.size(); ++k)
    if (on[k])
      worst = std::max(worst, SquaredResidual(graph.factors[k], poses) / graph.factors[k].loss.c2);
  return worst;
}

std::vector<double> Weights(const FactorGraph& graph, const std::vector<Pose2>& poses) {
  std::vector<double> weights;
  for (const Factor& f : graph.factors)
    weights.push_back(f.loss.Weight(SquaredResidual(f, poses), GraduatedLoss::kFinalMu));
  return weights;
}

// What the robust minimum is the minimum of.
double Cost(const FactorGraph& graph, const std::vector<Pose2>& poses) {
  double cost = 0.0;
  for (const Factor& f : graph.factors)
    cost += f.loss.Value(SquaredResidual(f, poses), GraduatedLoss::kFinalMu);
  return cost;
}

// Where every weight is still above zero: the paper's remark 5.
double FirstMu(double worst_ratio) {
  const double mu = 1.0 / (2.0 * worst_ratio - 1.0);
  return mu > 0.0 ? std::min(mu, GraduatedLoss::kFinalMu) : GraduatedLoss::kFinalMu;
}

// Squared Mahalanobis distance of what the factor says from what the graph without it says, from
// the residual r and its open part A (GraphCovariance::of_residual) in a graph that has the factor
// with weight w: innovation (I - w A)^-1 r, of covariance I + A (I - w A)^-1.
double InnovationSquared(const Eigen::Vector3d& r, const Eigen::Matrix3d& A, double w) {
  constexpr double kLeastRedundancy = 1e-7;  // below, nothing but the factor itself speaks of it
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
  const Eigen::Vector3d r_k = eigen.eigenvectors().transpose() * r;
  double squared = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double open = std::max(eigen.eigenvalues()(k), 0.0);
    const double redundancy = std::max(1.0 - w * open, kLeastRedundancy);
    const double innovation = r_k(k) / redundancy;
    squared += innovation * innovation / (1.0 + open / redundancy);
  }
  return squared;
}

double InnovationSquared(const FactorGraph& graph, std::size_t k, const RobustSolution& solution) {
  return InnovationSquared(Residual(graph.factors[k], solution.T_map_vertex),
                           solution.covariance->of_residual[k],
                           solution.weights[k]);
}

// Twice the threshold: one honest factor in millions, so that a large sound graph is solved once.
bool BelievesAgainstAllElse(const FactorGraph& graph, const RobustSolution& solution) {
  if (!solution.covariance) return false;
  for (std::size_t k = 0; k < graph.factors.size(); ++k)
    if (solution.weights[k] > 0.0 && std::isfinite(graph.factors[k].loss.c2) &&
        InnovationSquared(graph, k, solution) > 2.0 * graph.factors[k].loss.c2)
      return true;
  return false;
}

class RobustSolver {
 public:
  RobustSolver(const FactorGraph& graph,
               const std::vector<Pose2>& start,
               int newest,
               const SolverParams& params)
      : graph_(graph), problem_(graph, start), newest_(newest), params_(params) {}

  RobustSolution Solve() {
    RobustSolution solution = Graduate(std::vector<bool>(graph_.factors.size(), true));
    if (!BelievesAgainstAllElse(graph_, solution)) return solution;
    RobustSolution other = Graduate(NearDeadReckoning());
    if (Cost(graph_, other.T_map_vertex) >= Cost(graph_, solution.T_map_vertex)) return solution;
    other.quadratic = solution.quadratic;
    return other;
  }

 private:
  // From the minimum of the squares of those that are on to the robust minimum of all.
  RobustSolution Graduate(const std::vector<bool>& on) {
    constexpr int kRoughIterations = 3;
    constexpr int kSettledIterations = 10;
    using Shape = Stage::Shape;
    RobustSolution solution;
    problem_.Switch(on);
    problem_.Solve({Shape::kSquares}, Accuracy::kExact, params_.max_iterations);
    solution.quadratic = problem_.poses();
    const double worst = WorstRatio(graph_, on, solution.quadratic);
    for (double mu = FirstMu(worst); mu < GraduatedLoss::kFinalMu; mu *= params_.graduation_step)
      problem_.Solve({Shape::kGraduated, mu}, Accuracy::kRough, kRoughIterations);
    problem_.Switch(std::vector<bool>(on.size(), true));
    problem_.Solve({Shape::kGraduated}, Accuracy::kSettled, kSettledIterations);
    solution.weights = Weights(graph_, problem_.poses());
    problem_.Hold(solution.weights);
    solution.converged = problem_.Solve({Shape::kHeld}, Accuracy::kExact, params_.max_iterations);
    solution.T_map_vertex = problem_.poses();
    solution.covariance =
        ComputeCovariance(graph_, solution.T_map_vertex, solution.weights, newest_);
    return solution;
  }

  // The factors that lie within the chi-square gate of dead reckoning alone.
  std::vector<bool> NearDeadReckoning() {
    RobustSolution dead_reckoned;
    std::vector<bool> plain;
    for (const Factor& f : graph_.factors) {
      plain.push_back(!std::isfinite(f.loss.c2));
      dead_reckoned.weights.push_back(plain.back() ? 1.0 : 0.0);
    }
    problem_.Switch(plain);
    problem_.Solve({Stage::Shape::kSquares}, Accuracy::kExact, params_.max_iterations);
    dead_reckoned.T_map_vertex = problem_.poses();
    dead_reckoned.covariance = ComputeCovariance(
        graph_, dead_reckoned.T_map_vertex, dead_reckoned.weights, newest_, ResidualsOf::kAll);
    std::vector<bool> near = plain;
    if (!dead_reckoned.covariance) return near;
    for (std::size_t k = 0; k < near.size(); ++k)
      near[k] = near[k] || InnovationSquared(graph_, k, dead_reckoned) < graph_.factors[k].loss.c2;
    return near;
  }

  const FactorGraph& graph_;
  RobustProblem problem_;
  const int newest_;
  const SolverParams params_;
};

}  // namespace

RobustSolution SolveRobust(const FactorGraph& graph,
                           const std::vector<Pose2>& start,
                           int newest,
                           const SolverParams& params) {
  return RobustSolver(graph, start, newest, params).Solve();
}

}  // namespace seastitch
