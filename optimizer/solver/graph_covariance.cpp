#include "optimizer/solver/graph_covariance.hpp"

#include <Eigen/Dense>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>

namespace seastitch {
namespace {

using Eigen::Matrix3d;
using Sparse = Eigen::SparseMatrix<double>;

// Element of a std::vector at an int index.
template <class Vector>
auto& Of(Vector& values, int k) {
  return values[static_cast<std::size_t>(k)];
}

bool AllFinite(const std::vector<Matrix3d>& blocks) {
  return std::all_of(
      blocks.begin(), blocks.end(), [](const Matrix3d& block) { return block.allFinite(); });
}

}  // namespace

std::optional<GraphCovariance> GraphCovariance::At(const FactorGraph& graph,
                                                   const std::vector<Pose2>& T_map_vertex,
                                                   const std::vector<double>& weights) {
  GraphCovariance covariance;
  std::vector<EndJacobians> jacobians;
  for (const Factor& factor : graph.factors)
    Residual(factor, T_map_vertex, &jacobians.emplace_back());
  covariance.Order(graph);
  {
    const Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> llt(
        covariance.Information(graph, jacobians, weights));
    if (llt.info() != Eigen::Success) return std::nullopt;
    covariance.TakeBlocksOf(llt.matrixL().nestedExpression());
  }
  covariance.Select(graph, jacobians);
  // H may have a factor although its inverse overflows.
  if (!AllFinite(covariance.marginal_) || !AllFinite(covariance.of_residual_)) return std::nullopt;
  return covariance;
}

// Approximate minimum degree ordering of vertices, so that the three unknowns of one stay together.
void GraphCovariance::Order(const FactorGraph& graph) {
  const int n = graph.num_vertices;
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < n; ++v) entries.emplace_back(v, v, 1.0);
  for (const Factor& factor : graph.factors)
    for (const int a : factor.Ends())
      for (const int b : factor.Ends())
        if (a > b && b != kMap && a != graph.fixed_vertex && b != graph.fixed_vertex)
          entries.emplace_back(a, b, 1.0);
  Sparse pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(pattern, order);
  column_.assign(static_cast<std::size_t>(n), -1);
  int column = 0;
  for (int k = 0; k < n; ++k)
    if (const int v = order.indices()(k); v != graph.fixed_vertex) Of(column_, v) = column++;
}

// The lower triangle of H. Blocks of two vertices that share a factor are stored whole, zeros
// included, so that L has all blocks that of_residual() needs.
Eigen::SparseMatrix<double> GraphCovariance::Information(const FactorGraph& graph,
                                                         const std::vector<EndJacobians>& jacobians,
                                                         const std::vector<double>& weights) const {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < graph.factors.size(); ++k) {
    const std::array<int, 4> ends = graph.factors[k].Ends();
    for (std::size_t a = 0; a < ends.size(); ++a) {
      for (std::size_t b = 0; b < ends.size(); ++b) {
        const int row = 3 * Column(ends[a]), column = 3 * Column(ends[b]);
        if (column < 0 || row < column) continue;
        const Matrix3d block = weights[k] * jacobians[k][a].transpose() * jacobians[k][b];
        for (int c = 0; c < 3; ++c)
          for (int r = row == column ? c : 0; r < 3; ++r)
            entries.emplace_back(row + r, column + c, block(r, c));
      }
    }
  }
  const auto fixed = std::count(column_.begin(), column_.end(), -1);
  const auto size = 3 * (static_cast<Eigen::Index>(column_.size()) - fixed);
  Sparse H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  return H;
}

void GraphCovariance::TakeBlocksOf(const Sparse& L) {
  const int* first = L.outerIndexPtr();
  begin_ = {0};
  for (int k = 0; 3 * k < L.cols(); ++k) {
    // Column 3 k + c of L begins at its diagonal, row 3 k + c.
    for (int p = 0; p < first[3 * k + 1] - first[3 * k]; p += 3) {
      Matrix3d& block = block_.emplace_back(Matrix3d::Zero());
      row_.push_back(L.innerIndexPtr()[first[3 * k] + p] / 3);
      for (int c = 0; c < 3; ++c)
        for (int r = p == 0 ? c : 0; r < 3; ++r)
          block(r, c) = L.valuePtr()[first[3 * k + c] + p + r - c];
      if (p == 0) block = block.triangularView<Eigen::Lower>().solve(Matrix3d::Identity()).eval();
    }
    begin_.push_back(static_cast<int>(row_.size()));
  }
}

// Selected inverse: the blocks of H^-1 at the positions of the blocks of L, in their order
// (Takahashi's recursion). It uses the structure of L and not its values: a step at yaw 0 leaves
// zeros in L where the inverse has none.
std::vector<Matrix3d> GraphCovariance::SelectedInverse() const {
  std::vector<Matrix3d> Z(block_.size(), Matrix3d::Zero());
  std::vector<Matrix3d> column;               // the current one, times its diagonal block
  std::vector<int> place(begin_.size(), -1);  // index of each row's block in the current column
  for (int j = static_cast<int>(begin_.size()) - 2; j >= 0; --j) {
    const int diagonal = Of(begin_, j), end = Of(begin_, j + 1);
    column.clear();
    for (int p = diagonal; p < end; ++p) {
      column.push_back(Of(block_, p) * Of(block_, diagonal));
      Of(place, Of(row_, p)) = p > diagonal ? p : -1;
    }
    const auto scaled = [&](int p) -> const Matrix3d& { return Of(column, p - diagonal); };
    for (int p = diagonal + 1; p < end; ++p) {
      const int k = Of(row_, p);
      Of(Z, p) -= Of(Z, Of(begin_, k)) * scaled(p);
      for (int q = Of(begin_, k) + 1; q < Of(begin_, k + 1); ++q) {
        const int below = Of(place, Of(row_, q));
        if (below < 0) continue;
        Of(Z, below) -= Of(Z, q) * scaled(p);
        Of(Z, p) -= Of(Z, q).transpose() * scaled(below);
      }
    }
    Matrix3d Z_jj = Of(block_, diagonal).transpose() * Of(block_, diagonal);
    for (int p = diagonal + 1; p < end; ++p) {
      Z_jj -= scaled(p).transpose() * Of(Z, p);
      Of(place, Of(row_, p)) = -1;
    }
    Of(Z, diagonal) = 0.5 * (Z_jj + Z_jj.transpose());
  }
  return Z;
}

void GraphCovariance::Select(const FactorGraph& graph, const std::vector<EndJacobians>& jacobians) {
  const std::vector<Matrix3d> Z = SelectedInverse();
  const auto between = [&](int u, int v) -> Matrix3d {
    const int column = std::min(Column(u), Column(v)), row = std::max(Column(u), Column(v));
    if (column < 0) return Matrix3d::Zero();
    const auto found = std::lower_bound(
        row_.begin() + Of(begin_, column), row_.begin() + Of(begin_, column + 1), row);
    const Matrix3d& block = Z[static_cast<std::size_t>(found - row_.begin())];
    return Column(u) == row ? block : block.transpose();
  };
  for (int v = 0; v < graph.num_vertices; ++v) marginal_.push_back(between(v, v));
  for (std::size_t k = 0; k < graph.factors.size(); ++k) {
    const std::array<int, 4> ends = graph.factors[k].Ends();
    Matrix3d& open = of_residual_.emplace_back(Matrix3d::Zero());
    for (std::size_t a = 0; a < ends.size(); ++a)
      for (std::size_t b = 0; b < ends.size(); ++b)
        if (ends[a] != kMap && ends[b] != kMap)
          open += jacobians[k][a] * between(ends[a], ends[b]) * jacobians[k][b].transpose();
  }
}

// Solves along the path from the vertex to the root of the elimination tree: L^-1 is zero
// elsewhere.
GraphCovariance::InverseColumns GraphCovariance::InverseColumnsOf(int vertex) const {
  InverseColumns columns;
  std::vector<Matrix3d> right_side(begin_.size(), Matrix3d::Zero());
  int j = Column(vertex);
  if (j >= 0) Of(right_side, j).setIdentity();
  while (j >= 0) {
    const int diagonal = Of(begin_, j), end = Of(begin_, j + 1);
    const Matrix3d value = Of(block_, diagonal) * Of(right_side, j);
    columns.emplace_back(j, value);
    for (int p = diagonal + 1; p < end; ++p) Of(right_side, Of(row_, p)) -= Of(block_, p) * value;
    j = diagonal + 1 < end ? Of(row_, diagonal + 1) : -1;
  }
  return columns;
}

std::vector<Matrix3d> GraphCovariance::WithVertex(int vertex) const {
  std::vector<Matrix3d> by_column(begin_.size(), Matrix3d::Zero());
  for (const auto& [j, value] : InverseColumnsOf(vertex)) Of(by_column, j) = value;
  for (int j = static_cast<int>(begin_.size()) - 2; j >= 0; --j) {
    Matrix3d& at = Of(by_column, j);
    for (int p = Of(begin_, j) + 1; p < Of(begin_, j + 1); ++p)
      at -= Of(block_, p).transpose() * Of(by_column, Of(row_, p));
    at = (Of(block_, Of(begin_, j)).transpose() * at).eval();
  }
  std::vector<Matrix3d> out;
  for (const int column : column_)
    out.push_back(column < 0 ? Matrix3d(Matrix3d::Zero()) : Of(by_column, column));
  return out;
}

Matrix3d GraphCovariance::Pairs::operator()(int a, int b) {
  for (const int vertex : {a, b})
    if (!columns_.contains(vertex)) columns_[vertex] = of_.InverseColumnsOf(vertex);
  Matrix3d covariance = Matrix3d::Zero();
  const InverseColumns& of_b = columns_[b];
  auto j = of_b.begin();
  for (const auto& [row, value] : columns_[a]) {
    while (j != of_b.end() && j->first < row) ++j;
    if (j != of_b.end() && j->first == row) covariance += value.transpose() * j->second;
  }
  return covariance;
}

}  // namespace seastitch
