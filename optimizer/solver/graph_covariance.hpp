#pragma once

#include <Eigen/SparseCore>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "optimizer/solver/factor_graph.hpp"

namespace seastitch {

// Covariances of the vertices of a graph at given poses: blocks of the inverse of the information
// H = sum w J^T J = L L^T, where w is the inlier weight of a factor and J its Jacobian. The errors
// are additive in (x, y [m], yaw [rad]), map axes; those of a mounting vertex in its own three
// numbers. Zero for the fixed vertex.
class GraphCovariance {
 public:
  // Computes them. Absent where H is not positive definite (a vertex without any factor) or an
  // entry of its inverse overflows a double. Takes the time of about three factorisations.
  static std::optional<GraphCovariance> At(const FactorGraph& graph,
                                           const std::vector<Pose2>& T_map_vertex,
                                           const std::vector<double>& weights);

  // Covariance of each vertex.
  const std::vector<Eigen::Matrix3d>& marginal() const { return marginal_; }
  // Covariance of each factor's residual as propagated from the vertices: J covariance J^T, also
  // for factors of weight 0. It does not include the factor's own noise, which is the identity,
  // since residuals are whitened.
  const std::vector<Eigen::Matrix3d>& of_residual() const { return of_residual_; }
  // Cross-covariances of all vertices (rows) with one vertex (columns), at the cost of two
  // triangular solutions.
  std::vector<Eigen::Matrix3d> WithVertex(int vertex) const;

  // The three columns of L^-1 that belong to one vertex: non-zero blocks with their row, rows
  // rising.
  using InverseColumns = std::vector<std::pair<int, Eigen::Matrix3d>>;
  // Cross-covariances of single pairs: first vertex (rows), second vertex (columns). Columns of
  // L^-1 are cached, so that pairs that share a vertex are quick. For one vertex with all others
  // WithVertex() is quicker. Must not outlive the GraphCovariance.
  class Pairs {
   public:
    explicit Pairs(const GraphCovariance& covariance) : of_(covariance) {}
    Eigen::Matrix3d operator()(int a, int b);

   private:
    const GraphCovariance& of_;
    std::map<int, InverseColumns> columns_;
  };

 private:
  // Fill-reducing ordering of the vertices: sets column_.
  void Order(const FactorGraph& graph);
  Eigen::SparseMatrix<double> Information(const FactorGraph& graph,
                                          const std::vector<EndJacobians>& jacobians,
                                          const std::vector<double>& weights) const;
  void TakeBlocksOf(const Eigen::SparseMatrix<double>& L);
  std::vector<Eigen::Matrix3d> SelectedInverse() const;
  // Takes marginal_ and of_residual_ from the selected inverse.
  void Select(const FactorGraph& graph, const std::vector<EndJacobians>& jacobians);
  InverseColumns InverseColumnsOf(int vertex) const;
  int Column(int vertex) const {
    return vertex < 0 ? -1 : column_[static_cast<std::size_t>(vertex)];
  }

  // L as a sparse matrix of 3 x 3 blocks by columns, one block column per free vertex. A column has
  // the inverse of its diagonal block first, then the blocks below by rising row.
  std::vector<int> column_;  // block column of each vertex; -1: fixed
  std::vector<int> begin_;   // index of each column's first block in block_; last: their number
  std::vector<int> row_;     // row of each block
  std::vector<Eigen::Matrix3d> block_;
  std::vector<Eigen::Matrix3d> marginal_;
  std::vector<Eigen::Matrix3d> of_residual_;
};

}  // namespace seastitch
