#include "optimizer/normal_equations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace seastitch {
namespace {

template <class T>
T& At(std::vector<T>& v, int i) {
  return v[static_cast<std::size_t>(i)];
}

// Two ends of a factor.
constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

}  // namespace

std::vector<NormalEquations::Ends> NormalEquations::EndsOf(const FactorGraph& graph) {
  std::vector<Ends> all;
  int blocks = 0;
  for (const Factor& f : graph.factors) {
    const int mounting = f.by_mounting.isZero() ? kMap : graph.mounting_vertex;
    Ends ends{{f.i, f.j, mounting}, {}};
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      const auto [a, b] = kPairs[p];
      ends.block[p] = ends.vertex[a] == kMap || ends.vertex[b] == kMap ? -1 : blocks++;
    }
    all.push_back(ends);
  }
  return all;
}

BlockPattern NormalEquations::PatternOf(const std::vector<Ends>& all) {
  BlockPattern pattern;
  for (const Ends& ends : all)
    for (std::size_t p = 0; p < kPairs.size(); ++p)
      if (ends.block[p] >= 0)
        pattern.emplace_back(ends.vertex[kPairs[p].first], ends.vertex[kPairs[p].second]);
  return pattern;
}

NormalEquations::NormalEquations(const FactorGraph& graph)
    : graph_(graph),
      ends_(EndsOf(graph)),
      cholesky_(graph.num_vertices, PatternOf(ends_)),
      factors_(graph.factors.size()) {}

void NormalEquations::Linearise(const std::vector<Pose2>& T_map_vertex, Unknowns unknowns) {
  held_ = {1.0, 1.0, 1.0};
  if (unknowns != Unknowns::kPositions) held_.z() = 0.0;
  if (unknowns != Unknowns::kHeadings) held_.head<2>().setZero();
  const Eigen::Vector3d mounting = MountingIn(graph_, T_map_vertex);
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    const Factor& f = graph_.factors[k];
    auto& [residual, J] = factors_[k];
    const Pose2 T_map_i = f.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(f.i)];
    const Pose2& T_map_j = T_map_vertex[static_cast<std::size_t>(f.j)];
    J[2] = -f.cost.W * f.by_mounting;
    residual = f.cost.Evaluate(T_map_i, T_map_j, &J[0], &J[1]) + J[2] * mounting;
    if (unknowns == Unknowns::kHeadings) {
      const Eigen::Vector3d by_yaw = f.cost.W.col(2);
      residual = f.cost.Error(T_map_i, T_map_j).z() * by_yaw;
      J[0].col(2) = -by_yaw;
      J[1].col(2) = by_yaw;
      J[2].setZero();
    }
    for (int c = 0; c < 3; ++c)
      if (held_(c) != 0.0)
        for (Eigen::Matrix3d& by : J) by.col(c).setZero();
    for (std::size_t e = 0; e < J.size(); ++e)
      if (!IsFree(ends_[k].vertex[e])) J[e].setZero();
  }
}

// The fixed vertex keeps its place, as an unknown that nothing moves.
BlockMatrix NormalEquations::Hessian(const std::vector<double>& weights,
                                     const std::vector<double>& bends) const {
  const auto blocks = [](std::size_t n) {
    return std::vector<Eigen::Matrix3d>(n, Eigen::Matrix3d::Zero());
  };
  BlockMatrix H{blocks(static_cast<std::size_t>(graph_.num_vertices)),
                blocks(cholesky_.num_off_diagonal())};
  for (Eigen::Matrix3d& block : H.diagonal) block.diagonal() = held_;
  if (graph_.fixed_vertex >= 0) At(H.diagonal, graph_.fixed_vertex).setIdentity();
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const auto& [residual, J] = factors_[k];
    Eigen::Matrix3d curvature = weights[k] * Eigen::Matrix3d::Identity();
    if (bends[k] != 0.0) curvature += 2.0 * bends[k] * residual * residual.transpose();
    for (std::size_t e = 0; e < J.size(); ++e)
      if (ends_[k].vertex[e] != kMap)
        At(H.diagonal, ends_[k].vertex[e]) += J[e].transpose() * curvature * J[e];
    for (std::size_t p = 0; p < kPairs.size(); ++p)
      if (ends_[k].block[p] >= 0)
        At(H.off_diagonal, ends_[k].block[p]) =
            J[kPairs[p].first].transpose() * curvature * J[kPairs[p].second];
  }
  return H;
}

bool NormalEquations::Factorize(const std::vector<double>& weights, double damping) {
  BlockMatrix H = Hessian(weights, std::vector<double>(weights.size(), 0.0));
  for (Eigen::Matrix3d& block : H.diagonal) block.diagonal() *= 1.0 + damping;
  return cholesky_.Factorize(H);
}

bool NormalEquations::FactorizeNewton(const std::vector<double>& weights,
                                      const std::vector<double>& bends) {
  return cholesky_.Factorize(Hessian(weights, bends));
}

Eigen::VectorXd NormalEquations::Gradient(const std::vector<double>& weights) const {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * graph_.num_vertices);
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    if (weights[k] <= 0.0) continue;
    const auto& [residual, J] = factors_[k];
    for (std::size_t e = 0; e < J.size(); ++e)
      if (const int v = ends_[k].vertex[e]; v != kMap)
        g.segment<3>(3 * v) += J[e].transpose() * (weights[k] * residual);
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
    const auto& [residual, J] = factors_[k];
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (std::size_t e = 0; e < J.size(); ++e)
      if (const int v = ends_[k].vertex[e]; v != kMap) u += J[e] * x.segment<3>(3 * v);
    const Eigen::Vector3d Hu = weights[k] * u + 2.0 * bends[k] * residual.dot(u) * residual;
    for (std::size_t e = 0; e < J.size(); ++e)
      if (const int v = ends_[k].vertex[e]; v != kMap) y.segment<3>(3 * v) += J[e].transpose() * Hu;
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

Eigen::MatrixXd NormalEquations::CovarianceWith(int vertex) const {
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(3 * graph_.num_vertices, 3);
  if (IsFree(vertex)) unit.middleRows<3>(3 * vertex).setIdentity();
  return cholesky_.Solve(unit);
}

GraphCovariance NormalEquations::Covariance(int newest) const {
  BlockMatrix inverse = cholesky_.InverseInPattern();
  if (graph_.fixed_vertex >= 0) At(inverse.diagonal, graph_.fixed_vertex).setZero();
  const Eigen::MatrixXd columns = CovarianceWith(newest);

  GraphCovariance out{std::move(inverse.diagonal), {}, {}};
  for (int v = 0; v < graph_.num_vertices; ++v)
    out.with_newest.emplace_back(columns.middleRows<3>(3 * v));
  for (std::size_t k = 0; k < factors_.size(); ++k) {
    const auto& J = factors_[k].J;
    Eigen::Matrix3d& open = out.of_residual.emplace_back(Eigen::Matrix3d::Zero());
    for (std::size_t e = 0; e < J.size(); ++e)
      if (const int v = ends_[k].vertex[e]; v != kMap)
        open += J[e] * At(out.marginal, v) * J[e].transpose();
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      if (ends_[k].block[p] < 0) continue;
      const Eigen::Matrix3d cross = J[kPairs[p].first] *
                                    At(inverse.off_diagonal, ends_[k].block[p]) *
                                    J[kPairs[p].second].transpose();
      open += cross + cross.transpose();
    }
  }
  return out;
}

}  // namespace seastitch
