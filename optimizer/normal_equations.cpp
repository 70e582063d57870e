#include "optimizer/normal_equations.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {
namespace {

template <class T>
T& At(std::vector<T>& v, int i) {
  return v[static_cast<std::size_t>(i)];
}

// A factor that ties a vertex to the map ties no two unknowns.
BlockPattern PatternOf(const FactorGraph& graph) {
  BlockPattern pattern;
  for (const Factor& f : graph.factors) pattern.emplace_back(f.i == kMap ? f.j : f.i, f.j);
  return pattern;
}

}  // namespace

NormalEquations::NormalEquations(const FactorGraph& graph)
    : graph_(graph),
      cholesky_(graph.num_vertices, PatternOf(graph)),
      factors_(graph.factors.size()) {}

void NormalEquations::Linearise(const std::vector<Pose2>& T_map_vertex, Unknowns unknowns) {
  held_ = {1.0, 1.0, 1.0};
  if (unknowns != Unknowns::kPositions) held_.z() = 0.0;
  if (unknowns != Unknowns::kHeadings) held_.head<2>().setZero();
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    const Factor& f = graph_.factors[k];
    Linearised& at = factors_[k];
    const Pose2 T_map_i = f.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(f.i)];
    at.residual =
        f.cost.Evaluate(T_map_i, T_map_vertex[static_cast<std::size_t>(f.j)], &at.J_i, &at.J_j);
    if (unknowns == Unknowns::kHeadings) {
      const Pose2& T_map_j = T_map_vertex[static_cast<std::size_t>(f.j)];
      const Eigen::Vector3d by_yaw = f.cost.W.col(2);
      at.residual = f.cost.Error(T_map_i, T_map_j).z() * by_yaw;
      at.J_i.col(2) = -by_yaw;
      at.J_j.col(2) = by_yaw;
    }
    for (int c = 0; c < 3; ++c) {
      if (held_(c) == 0.0) continue;
      at.J_i.col(c).setZero();
      at.J_j.col(c).setZero();
    }
    if (!IsFree(f.i)) at.J_i.setZero();
    if (!IsFree(f.j)) at.J_j.setZero();
  }
}

// The fixed vertex keeps its place, as an unknown that nothing moves.
BlockMatrix NormalEquations::Hessian(const std::vector<double>& weights) const {
  BlockMatrix H{std::vector<Eigen::Matrix3d>(static_cast<std::size_t>(graph_.num_vertices),
                                             Eigen::Matrix3d::Zero()),
                std::vector<Eigen::Matrix3d>(factors_.size(), Eigen::Matrix3d::Zero())};
  for (Eigen::Matrix3d& block : H.diagonal) block.diagonal() = held_;
  if (graph_.fixed_vertex >= 0) At(H.diagonal, graph_.fixed_vertex).setIdentity();
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const Factor& f = graph_.factors[k];
    const Linearised& at = factors_[k];
    At(H.diagonal, f.j) += weights[k] * at.J_j.transpose() * at.J_j;
    if (f.i == kMap) continue;
    At(H.diagonal, f.i) += weights[k] * at.J_i.transpose() * at.J_i;
    H.off_diagonal[k] = weights[k] * at.J_i.transpose() * at.J_j;
  }
  return H;
}

bool NormalEquations::Factorize(const std::vector<double>& weights, double damping) {
  BlockMatrix H = Hessian(weights);
  for (Eigen::Matrix3d& block : H.diagonal) block.diagonal() *= 1.0 + damping;
  return cholesky_.Factorize(H);
}

void NormalEquations::AddBends(const std::vector<double>& bends, BlockMatrix* H) const {
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (bends[k] == 0.0) continue;
    const Factor& f = graph_.factors[k];
    const Eigen::Vector3d g_i = factors_[k].J_i.transpose() * factors_[k].residual;
    const Eigen::Vector3d g_j = factors_[k].J_j.transpose() * factors_[k].residual;
    At(H->diagonal, f.j) += 2.0 * bends[k] * g_j * g_j.transpose();
    if (f.i == kMap) continue;
    At(H->diagonal, f.i) += 2.0 * bends[k] * g_i * g_i.transpose();
    H->off_diagonal[k] += 2.0 * bends[k] * g_i * g_j.transpose();
  }
}

bool NormalEquations::FactorizeNewton(const std::vector<double>& weights,
                                      const std::vector<double>& bends) {
  BlockMatrix H = Hessian(weights);
  AddBends(bends, &H);
  return cholesky_.Factorize(H);
}

Eigen::VectorXd NormalEquations::Gradient(const std::vector<double>& weights) const {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * graph_.num_vertices);
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const Factor& f = graph_.factors[k];
    const Linearised& at = factors_[k];
    const Eigen::Vector3d r = weights[k] * at.residual;
    g.segment<3>(3 * f.j) += at.J_j.transpose() * r;
    if (f.i != kMap) g.segment<3>(3 * f.i) += at.J_i.transpose() * r;
  }
  return g;
}

Eigen::VectorXd NormalEquations::Multiply(const std::vector<double>& weights,
                                          const std::vector<double>& bends,
                                          const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = held_.replicate(graph_.num_vertices, 1).cwiseProduct(x);
  if (graph_.fixed_vertex >= 0)
    y.segment<3>(3 * graph_.fixed_vertex) = x.segment<3>(3 * graph_.fixed_vertex);
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const Factor& f = graph_.factors[k];
    const Linearised& at = factors_[k];
    Eigen::Vector3d u = at.J_j * x.segment<3>(3 * f.j);
    if (f.i != kMap) u += at.J_i * x.segment<3>(3 * f.i);
    const Eigen::Vector3d v = weights[k] * u + 2.0 * bends[k] * at.residual.dot(u) * at.residual;
    y.segment<3>(3 * f.j) += at.J_j.transpose() * v;
    if (f.i != kMap) y.segment<3>(3 * f.i) += at.J_i.transpose() * v;
  }
  return y;
}

NewtonStep NormalEquations::Step(const std::vector<double>& weights) const {
  const Eigen::VectorXd g = Gradient(weights);
  NewtonStep step{-cholesky_.Solve(g)};
  step.sigmas = std::sqrt(std::max(0.0, -g.dot(step.by)));
  return step;
}

// Hestenes and Stiefel, preconditioned.
NewtonStep NormalEquations::IteratedStep(const std::vector<double>& weights,
                                         const std::vector<double>& bends,
                                         int max_iterations) const {
  constexpr double kRelativeError = 1e-2;  // of the step, in standard deviations
  const Eigen::VectorXd g = Gradient(weights);
  NewtonStep step{Eigen::VectorXd::Zero(g.size())};
  Eigen::VectorXd r = -g;
  Eigen::VectorXd z = cholesky_.Solve(r);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  const double enough = kRelativeError * kRelativeError * rz;
  while (rz > enough && step.iterations < max_iterations) {
    ++step.iterations;
    const Eigen::VectorXd Hp = Multiply(weights, bends, p);
    const double curvature = p.dot(Hp);
    if (!(curvature > 0.0)) {
      const std::vector<double> none(bends.size(), 0.0);
      step.by += rz / p.dot(Multiply(weights, none, p)) * p;
      step.bends_down = true;
      break;
    }
    step.by += rz / curvature * p;
    r -= rz / curvature * Hp;
    z = cholesky_.Solve(r);
    const double rz_before = rz;
    rz = r.dot(z);
    p = z + rz / rz_before * p;
  }
  step.sigmas = std::sqrt(std::max(0.0, -g.dot(step.by)));
  return step;
}

GraphCovariance NormalEquations::Covariance(int newest) const {
  BlockMatrix inverse = cholesky_.InverseInPattern();
  if (graph_.fixed_vertex >= 0) At(inverse.diagonal, graph_.fixed_vertex).setZero();
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(3 * graph_.num_vertices, 3);
  if (IsFree(newest)) unit.middleRows<3>(3 * newest).setIdentity();
  const Eigen::MatrixXd columns = cholesky_.Solve(unit);

  GraphCovariance out{std::move(inverse.diagonal), {}, {}};
  for (int v = 0; v < graph_.num_vertices; ++v)
    out.with_newest.emplace_back(columns.middleRows<3>(3 * v));
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    const Factor& f = graph_.factors[k];
    const Linearised& at = factors_[k];
    Eigen::Matrix3d& open =
        out.of_residual.emplace_back(at.J_j * At(out.marginal, f.j) * at.J_j.transpose());
    if (f.i == kMap) continue;
    const Eigen::Matrix3d cross = at.J_i * inverse.off_diagonal[k] * at.J_j.transpose();
    open += at.J_i * At(out.marginal, f.i) * at.J_i.transpose() + cross + cross.transpose();
  }
  return out;
}

}  // namespace seastitch
