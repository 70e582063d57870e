#include "optimizer/graph_covariance.hpp"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>

namespace seastitch {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Factorization = Eigen::SimplicialLDLT<Sparse, Eigen::Lower>;

// First row of a vertex in the Hessian, -1 for the fixed one, which has none.
int RowOf(const FactorGraph& graph, int vertex) {
  if (vertex == kMap || vertex == graph.fixed_vertex) return -1;
  const bool after_fixed = graph.fixed_vertex >= 0 && vertex > graph.fixed_vertex;
  return 3 * (after_fixed ? vertex - 1 : vertex);
}

// Adds the part of a block that lies in the lower triangle.
void AddBlock(const Eigen::Matrix3d& block,
              int row,
              int column,
              std::vector<Eigen::Triplet<double>>* out) {
  if (row < column) return AddBlock(block.transpose(), column, row, out);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      if (row + r >= column + c) out->emplace_back(row + r, column + c, block(r, c));
}

// The derivatives of a factor's residual; those of a vertex without rows are zero.
struct Jacobians {
  Eigen::Matrix3d i = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
};

Jacobians JacobiansOf(const Factor& f, const std::vector<Pose2>& poses) {
  Jacobians J;
  const Pose2 T_map_i = f.i == kMap ? Pose2{} : poses[static_cast<std::size_t>(f.i)];
  f.cost.Evaluate(T_map_i, poses[static_cast<std::size_t>(f.j)], &J.i, &J.j);
  return J;
}

Sparse Hessian(const FactorGraph& graph,
               const std::vector<Pose2>& poses,
               const std::vector<double>& weights,
               ResidualsOf residuals) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < graph.factors.size(); ++k) {
    const double w = weights[k];
    if (w <= 0.0 && residuals == ResidualsOf::kWeighted) continue;
    const Factor& f = graph.factors[k];
    const Jacobians J = JacobiansOf(f, poses);
    const int i = RowOf(graph, f.i);
    const int j = RowOf(graph, f.j);
    if (i >= 0) AddBlock(w * J.i.transpose() * J.i, i, i, &entries);
    if (j >= 0) AddBlock(w * J.j.transpose() * J.j, j, j, &entries);
    if (i >= 0 && j >= 0) AddBlock(w * J.i.transpose() * J.j, i, j, &entries);
  }
  const int size = 3 * (graph.num_vertices - (graph.fixed_vertex >= 0 ? 1 : 0));
  Sparse H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  return H;
}

// The inverse of L D L^T on the pattern of L: Z(r, j) = -sum_k L(k, j) Z(r, k) over the rows k of
// column j, last column first. L: unit lower triangular, diagonal not stored.
class SelectedInverse {
 public:
  SelectedInverse(const Sparse& L, const Eigen::VectorXd& D) : L_(L), z_(L), diagonal_(D.size()) {
    std::vector<int> slot(static_cast<std::size_t>(D.size()), -1);
    for (int j = static_cast<int>(D.size()) - 1; j >= 0; --j) ComputeColumn(j, D(j), &slot);
  }

  double At(int r, int c) const {
    if (r == c) return diagonal_(r);
    return z_.coeff(std::max(r, c), std::min(r, c));
  }

 private:
  // slot: scratch, -1 everywhere between calls; the place in column j of each of its rows.
  void ComputeColumn(int j, double d, std::vector<int>* slot) {
    const int begin = L_.outerIndexPtr()[j];
    const int end = L_.outerIndexPtr()[j + 1];
    const int* row = L_.innerIndexPtr();
    const double* l = L_.valuePtr();
    double* z = z_.valuePtr();
    for (int a = begin; a < end; ++a) {
      (*slot)[static_cast<std::size_t>(row[a])] = a;
      z[a] = 0.0;
    }
    for (int b = begin; b < end; ++b) {
      const int k = row[b];
      double zb = l[b] * diagonal_(k);
      for (int p = L_.outerIndexPtr()[k]; p < L_.outerIndexPtr()[k + 1]; ++p) {
        const int a = (*slot)[static_cast<std::size_t>(row[p])];
        if (a < 0) continue;
        z[a] -= l[b] * z[p];
        zb += l[a] * z[p];
      }
      z[b] -= zb;
    }
    diagonal_(j) = 1.0 / d;
    for (int a = begin; a < end; ++a) {
      diagonal_(j) -= l[a] * z[a];
      (*slot)[static_cast<std::size_t>(row[a])] = -1;
    }
  }

  const Sparse& L_;
  Sparse z_;
  Eigen::VectorXd diagonal_;
};

// The inverse by vertices of the graph.
class BlockInverse {
 public:
  BlockInverse(const FactorGraph& graph, const Factorization& factorization)
      : graph_(graph),
        inverse_(factorization.matrixL().nestedExpression(), factorization.vectorD()),
        permuted_(factorization.permutationP().indices()) {}

  // Covariance of vertex a (rows) with vertex b; they must share a factor. Zero for the fixed one.
  Eigen::Matrix3d Between(int a, int b) const {
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    const int row = RowOf(graph_, a);
    const int column = RowOf(graph_, b);
    if (row < 0 || column < 0) return block;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        block(r, c) = inverse_.At(permuted_(row + r), permuted_(column + c));
    return block;
  }

  Eigen::Matrix3d OfResidual(const Factor& f, const std::vector<Pose2>& poses) const {
    const Jacobians J = JacobiansOf(f, poses);
    const Eigen::Matrix3d cross = J.i * Between(f.i, f.j) * J.j.transpose();
    return J.i * Between(f.i, f.i) * J.i.transpose() + cross + cross.transpose() +
           J.j * Between(f.j, f.j) * J.j.transpose();
  }

 private:
  const FactorGraph& graph_;
  const SelectedInverse inverse_;
  const Eigen::VectorXi permuted_;
};

// The columns of the inverse that belong to one vertex.
Eigen::MatrixXd ColumnsOf(int vertex, const FactorGraph& graph, const Factorization& f) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(f.rows(), 3);
  const int first = RowOf(graph, vertex);
  if (first < 0) return columns;
  columns.middleRows<3>(first).setIdentity();
  return f.solve(columns);
}

}  // namespace

std::optional<GraphCovariance> ComputeCovariance(const FactorGraph& graph,
                                                 const std::vector<Pose2>& T_map_vertex,
                                                 const std::vector<double>& weights,
                                                 int newest,
                                                 ResidualsOf residuals) {
  const std::vector<Eigen::Matrix3d> zeros(static_cast<std::size_t>(graph.num_vertices),
                                           Eigen::Matrix3d::Zero());
  GraphCovariance out{
      zeros, zeros, std::vector<Eigen::Matrix3d>(graph.factors.size(), Eigen::Matrix3d::Zero())};
  const Sparse H = Hessian(graph, T_map_vertex, weights, residuals);
  if (H.rows() == 0) return out;
  const Factorization factorization(H);
  if (factorization.info() != Eigen::Success || !(factorization.vectorD().minCoeff() > 0.0))
    return std::nullopt;

  const BlockInverse inverse(graph, factorization);
  const Eigen::MatrixXd columns = ColumnsOf(newest, graph, factorization);
  for (int v = 0; v < graph.num_vertices; ++v) {
    const int first = RowOf(graph, v);
    if (first < 0) continue;
    out.marginal[static_cast<std::size_t>(v)] = inverse.Between(v, v);
    out.with_newest[static_cast<std::size_t>(v)] = columns.middleRows<3>(first);
  }
  for (std::size_t k = 0; k < graph.factors.size(); ++k)
    if (weights[k] > 0.0 || residuals == ResidualsOf::kAll)
      out.of_residual[k] = inverse.OfResidual(graph.factors[k], T_map_vertex);
  return out;
}

}  // namespace seastitch
