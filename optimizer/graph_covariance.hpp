#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Covariances of (x, y [m], yaw [rad]) in map axes, one a vertex; zero for the fixed vertex.
struct GraphCovariance {
  std::vector<Eigen::Matrix3d> marginal;
  std::vector<Eigen::Matrix3d> with_newest;  // rows: the vertex; columns: vertex `newest`
  // One a factor: what the graph leaves open of its residual, W J covariance J^T W^T. Identity is
  // as much as the factor's own noise. Zero for factors left out.
  std::vector<Eigen::Matrix3d> of_residual;
};

// Whether of_residual is wanted of factors whose weight is zero, too (it makes the inverse fuller).
enum class ResidualsOf { kWeighted, kAll };

// Inverts the weighted Gauss-Newton Hessian of the graph at the given poses where it is wanted. The
// marginals come from the sparse factor L D L^T by Takahashi's recursion (Erisman and Tinney, "On
// computing certain elements of the inverse of a sparse matrix", CACM 1975), which is exact and
// never leaves the pattern of L; the columns of the newest vertex come from three solves. Nothing
// where the Hessian is not positive definite: some vertex is tied to nothing.
std::optional<GraphCovariance> ComputeCovariance(const FactorGraph& graph,
                                                 const std::vector<Pose2>& T_map_vertex,
                                                 const std::vector<double>& weights,
                                                 int newest,
                                                 ResidualsOf residuals = ResidualsOf::kWeighted);

}  // namespace seastitch
