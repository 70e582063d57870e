#pragma once

#include <Eigen/SparseCore>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Covariances of a graph at given poses, each factor at its weight: the inverse of the information
// H = sum w J^T J = L L^T. Of (x, y [m], yaw [rad]) in map axes; zero for the fixed vertex.
class GraphCovariance {
 public:
  // Nothing where H is not positive definite (some vertex is tied to nothing) or its inverse too
  // large. Takes about three factorisations.
  static std::optional<GraphCovariance> At(const FactorGraph& graph,
                                           const std::vector<Pose2>& T_map_vertex,
                                           const std::vector<double>& weights);

  // One a vertex.
  const std::vector<Eigen::Matrix3d>& marginal() const { return marginal_; }
  // One a factor, whatever its weight: what the graph leaves open of its residual, J covariance
  // J^T. Identity is as much as the factor's own noise.
  const std::vector<Eigen::Matrix3d>& of_residual() const { return of_residual_; }
  // Of every vertex (rows) with this one (columns).
  std::vector<Eigen::Matrix3d> WithVertex(int vertex) const;

  // The three columns of L^-1 of a vertex: its rows that are not zero, by rising number.
  using InverseColumns = std::vector<std::pair<int, Eigen::Matrix3d>>;
  // Of the first vertex (rows) with the second: for a few, and quickest for the same ones again.
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
