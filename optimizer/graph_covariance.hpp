#pragma once

#include <Eigen/SparseCholesky>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Covariances of a graph at given poses, each factor at its weight: the inverse of the information
// H = sum w J^T J = L L^T. Of (x, y [m], yaw [rad]) in map axes; zero for the fixed vertex. The
// graph must outlive it.
class GraphCovariance {
 public:
  // Nothing where H is not positive definite: some vertex is tied to nothing.
  static std::optional<GraphCovariance> At(const FactorGraph& graph,
                                           const std::vector<Pose2>& T_map_vertex,
                                           const std::vector<double>& weights);

  struct Selected {
    std::vector<Eigen::Matrix3d> marginal;  // one a vertex
    // One a factor, whatever its weight: what the graph leaves open of its residual, J covariance
    // J^T. Identity is as much as the factor's own noise.
    std::vector<Eigen::Matrix3d> of_residual;
  };
  // At the cost of about two factorisations.
  Selected MarginalsAndResiduals() const;
  // Of every vertex (rows) with this one (columns).
  std::vector<Eigen::Matrix3d> WithVertex(int vertex) const;
  // Of the first vertex (rows) with the second: for a few, and quickest for the same ones again.
  class Pairs {
   public:
    explicit Pairs(const GraphCovariance& covariance)
        : of_(covariance),
          work_(static_cast<std::size_t>(covariance.L().cols()), Eigen::Vector3d::Zero()) {}
    Eigen::Matrix3d operator()(int a, int b);

   private:
    // The three columns of L^-1 of a vertex: its rows that are not zero, by rising number.
    using InverseColumns = std::vector<std::pair<int, Eigen::Vector3d>>;
    const InverseColumns& ColumnsOf(int vertex);
    const GraphCovariance& of_;
    std::map<int, InverseColumns> columns_;
    std::vector<Eigen::Vector3d> work_;
  };
  // Of a residual as in Selected, block(a, b) being the covariance of two vertices.
  template <class Block>
  Eigen::Matrix3d OfResidual(std::size_t factor, Block&& block) const;

 private:
  using Sparse = Eigen::SparseMatrix<double>;

  explicit GraphCovariance(const FactorGraph& graph) : graph_(&graph) {}
  void Order();
  Sparse Information(const std::vector<double>& weights) const;
  std::vector<double> SelectedInverse() const;
  const Sparse& L() const { return llt_->matrixL().nestedExpression(); }
  bool IsFree(int vertex) const { return vertex != kMap && vertex != graph_->fixed_vertex; }
  int Column(int vertex) const { return column_[static_cast<std::size_t>(vertex)]; }

  const FactorGraph* graph_;
  std::vector<EndJacobians> jacobians_;  // one a factor
  std::vector<int> column_;              // in H, the first of three, one a vertex
  std::unique_ptr<Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>>> llt_;
};

template <class Block>
Eigen::Matrix3d GraphCovariance::OfResidual(std::size_t factor, Block&& block) const {
  const std::array<int, 3> ends = graph_->EndsOf(graph_->factors[factor]);
  const EndJacobians& J = jacobians_[factor];
  Eigen::Matrix3d open = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < ends.size(); ++a)
    for (std::size_t b = 0; b < ends.size(); ++b)
      if (IsFree(ends[a]) && IsFree(ends[b]))
        open += J[a] * block(ends[a], ends[b]) * J[b].transpose();
  return open;
}

}  // namespace seastitch
