#include "optimizer/solver/ceres_minimiser.hpp"

#include <ceres/ceres.h>

#include <deque>
#include <utility>

namespace seastitch {

namespace {

using RowMajor = Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

class FactorCost : public ceres::CostFunction {
 public:
  explicit FactorCost(const Factor& factor) : factor_(factor) {
    set_num_residuals(3);
    const std::array<int, 4> ends = factor.Ends();
    for (std::size_t e = 0; e < ends.size(); ++e) {
      if (ends[e] == kMap) continue;
      block_[e] = static_cast<int>(parameter_block_sizes().size());
      mutable_parameter_block_sizes()->push_back(3);
    }
  }

  bool Evaluate(const double* const* blocks, double* residual, double** jacobians) const override {
    EndPoses at;
    at.fill(Eigen::Vector3d::Zero());
    for (std::size_t e = 0; e < at.size(); ++e)
      if (block_[e] >= 0) at[e] = Eigen::Map<const Eigen::Vector3d>(blocks[block_[e]]);
    EndJacobians J;
    Eigen::Map<Eigen::Vector3d>{residual} = Residual(factor_, at, jacobians ? &J : nullptr);
    for (std::size_t e = 0; jacobians != nullptr && e < at.size(); ++e)
      if (block_[e] >= 0 && jacobians[block_[e]] != nullptr) RowMajor{jacobians[block_[e]]} = J[e];
    return true;
  }

 private:
  const Factor& factor_;
  std::array<int, 4> block_{-1, -1, -1, -1};  // parameter block of each of Ends(); -1: none
};

// The loss of one factor at the current stage.
class FactorLoss : public ceres::LossFunction {
 public:
  FactorLoss(const Factor& factor, std::size_t k, const Losses* const* losses)
      : factor_(factor), k_(k), losses_(losses) {}

  void Evaluate(double s, double rho[3]) const override {
    rho[0] = (*losses_)->Value(factor_, k_, s);
    rho[1] = (*losses_)->Weight(factor_, k_, s);
    rho[2] = 0.0;  // the second derivative is negative, which Ceres ignores
  }

 private:
  const Factor& factor_;
  const std::size_t k_;
  const Losses* const* losses_;
};

ceres::Problem::Options OwningNothing() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

// Nearly Gauss-Newton: the problem is nearly linear, so a large trust region saves two thirds of
// the iterations. Scaling columns gains nothing, because all blocks have the same units. Eigen's
// factorisation gives the same bytes whatever BLAS is installed, and is faster than an untuned
// BLAS.
ceres::Solver::Options SolverOptions(int max_iterations, double tolerance) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.initial_trust_region_radius = 1e8;
  options.jacobi_scaling = false;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = tolerance;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-14;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

// Calls on_step after every iteration of Ceres.
class StepCallback : public ceres::IterationCallback {
 public:
  explicit StepCallback(std::function<void()> on_step) : on_step_(std::move(on_step)) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    if (on_step_) on_step_();
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<void()> on_step_;
};

}  // namespace

class CeresMinimiser::Problem {
 public:
  Problem(const FactorGraph& graph, std::function<void()> on_step)
      : callback(std::move(on_step)),
        x(static_cast<std::size_t>(graph.num_vertices), Eigen::Vector3d::Zero()) {
    for (Eigen::Vector3d& vertex : x) problem.AddParameterBlock(vertex.data(), 3);
    for (std::size_t k = 0; k < graph.factors.size(); ++k) {
      const Factor& factor = graph.factors[k];
      std::vector<double*> blocks;
      for (const int vertex : factor.Ends())
        if (vertex != kMap) blocks.push_back(x[static_cast<std::size_t>(vertex)].data());
      costs.emplace_back(factor);
      ceres::LossFunction* loss =
          factor.IsRobust() ? &robust.emplace_back(factor, k, &losses) : nullptr;
      problem.AddResidualBlock(&costs.back(), loss, blocks);
    }
    if (graph.fixed_vertex >= 0)
      problem.SetParameterBlockConstant(x[static_cast<std::size_t>(graph.fixed_vertex)].data());
  }

  StepCallback callback;
  std::vector<Eigen::Vector3d> x;
  const Losses* losses = nullptr;
  std::deque<FactorCost> costs;
  std::deque<FactorLoss> robust;
  ceres::Problem problem{OwningNothing()};
};

CeresMinimiser::CeresMinimiser(const FactorGraph& graph, std::function<void()> on_step)
    : problem_(std::make_unique<Problem>(graph, std::move(on_step))) {}

CeresMinimiser::~CeresMinimiser() = default;

bool CeresMinimiser::Minimise(const Losses& losses,
                              int max_iterations,
                              double tolerance,
                              std::vector<Pose2>* T_map_vertex) {
  std::vector<Eigen::Vector3d>& x = problem_->x;
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = (*T_map_vertex)[v].Vector();
  problem_->losses = &losses;
  ceres::Solver::Options options = SolverOptions(max_iterations, tolerance);
  options.callbacks.push_back(&problem_->callback);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_->problem, &summary);
  for (std::size_t v = 0; v < x.size(); ++v) (*T_map_vertex)[v] = {x[v].x(), x[v].y(), x[v].z()};
  if (summary.termination_type != ceres::CONVERGENCE) return false;
  // Ceres also reports convergence where it shrank the trust region and no step lowered the cost.
  return summary.iterations.empty() ||
         summary.iterations.back().trust_region_radius > options.min_trust_region_radius;
}

}  // namespace seastitch
