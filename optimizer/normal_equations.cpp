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

void NormalEquations::Linearise(const std::vector<Pose2>& T_map_vertex) {
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    const Factor& f = graph_.factors[k];
    Linearised& at = factors_[k];
    const Pose2 T_map_i = f.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(f.i)];
    at.residual =
        f.cost.Evaluate(T_map_i, T_map_vertex[static_cast<std::size_t>(f.j)], &at.J_i, &at.J_j);
    if (!IsFree(f.i)) at.J_i.setZero();
    if (!IsFree(f.j)) at.J_j.setZero();
  }
}

// The fixed vertex keeps its place, as an unknown that nothing moves.
BlockMatrix NormalEquations::Hessian(const std::vector<double>& weights) const {
  BlockMatrix H{std::vector<Eigen::Matrix3d>(static_cast<std::size_t>(graph_.num_vertices),
                                             Eigen::Matrix3d::Zero()),
                std::vector<Eigen::Matrix3d>(factors_.size(), Eigen::Matrix3d::Zero())};
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

NewtonStep NormalEquations::Step(const std::vector<double>& weights) const {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * graph_.num_vertices);
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const Factor& f = graph_.factors[k];
    const Linearised& at = factors_[k];
    const Eigen::Vector3d r = weights[k] * at.residual;
    g.segment<3>(3 * f.j) += at.J_j.transpose() * r;
    if (f.i != kMap) g.segment<3>(3 * f.i) += at.J_i.transpose() * r;
  }
  NewtonStep step{-cholesky_.Solve(g), 0.0};
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
