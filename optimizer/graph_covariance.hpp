#pragma once

#include <Eigen/SparseCore>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Covariances of (x, y [m], yaw [rad]), map axes, of the vertices of a graph at given poses: blocks
// of the inverse of the information H = sum w J^T J = L L^T, w being the weights of the factors.
// Zero for the fixed vertex.
class GraphCovariance {
 public:
  // Absent where H is not positive definite (a vertex without any factor) or its inverse too large.
  // Takes the time of about three factorisations.
  static std::optional<GraphCovariance> At(const FactorGraph& graph,
                                           const std::vector<Pose2>& T_map_vertex,
                                           const std::vector<double>& weights);

  // One for each vertex.
  const std::vector<Eigen::Matrix3d>& marginal() const { return marginal_; }
  // One for each factor, whatever its weight: covariance of its residual by that of the vertices,
  // J covariance J^T. The factor's own noise is the identity.
  const std::vector<Eigen::Matrix3d>& of_residual() const { return of_residual_; }
  // Cross-covariance of every vertex (rows) with this one (columns).
  std::vector<Eigen::Matrix3d> WithVertex(int vertex) const;

  // Three columns of L^-1, those of one vertex: the non-zero blocks by rising row.
  using InverseColumns = std::vector<std::pair<int, Eigen::Matrix3d>>;
  // Cross-covariance of the first vertex (rows) with the second. For a few pairs; columns are kept,
  // so that pairs that share a vertex are quick.
  class Pairs {
   public:
    explicit Pairs(const GraphCovariance& covariance) : of_(covariance) {}
    Eigen::Matrix3d operator()(int a, int b);

   private:
    const GraphCovariance& of_;
    std::map<int, InverseColumns> columns_;
  };

 private:
  void Order(const FactorGraph& graph);
  Eigen::SparseMatrix<double> Information(const FactorGraph& graph,
                                          const std::vector<EndJacobians>& jacobians,
                                          const std::vector<double>& weights) const;
  void TakeBlocksOf(const Eigen::SparseMatrix<double>& L);
  std::vector<Eigen::Matrix3d> SelectedInverse() const;
  void Select(const FactorGraph& graph, const std::vector<EndJacobians>& jacobians);
  InverseColumns InverseColumnsOf(int vertex) const;
  int Column(int vertex) const {
    return vertex < 0 ? -1 : column_[static_cast<std::size_t>(vertex)];
  }

  // L in blocks of 3 x 3, one column a free vertex: that of the diagonal, inverted, first, then
  // those below by rising row.
  std::vector<int> column_;  // one a vertex; -1: fixed
  std::vector<int> begin_;   // one a column, and the end
  std::vector<int> row_;     // one a block
  std::vector<Eigen::Matrix3d> block_;
  std::vector<Eigen::Matrix3d> marginal_;
  std::vector<Eigen::Matrix3d> of_residual_;
};

}  // namespace seastitch
