#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "optimizer/block_cholesky.hpp"
#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Covariances of (x, y [m], yaw [rad]) in map axes, one a vertex; zero for the fixed vertex.
struct GraphCovariance {
  std::vector<Eigen::Matrix3d> marginal;
  std::vector<Eigen::Matrix3d> with_newest;  // rows: the vertex; columns: vertex `newest`
  // One a factor: what the graph leaves open of its residual, W J covariance J^T W^T. Identity is
  // as much as the factor's own noise.
  std::vector<Eigen::Matrix3d> of_residual;
};

struct NewtonStep {
  Eigen::VectorXd by;       // x, y [m], yaw [rad] of each vertex
  double sigmas = 0.0;      // its length in standard deviations: the Newton decrement
  int iterations = 0;       // of conjugate gradients
  bool bends_down = false;  // they met no minimum; as far as there would be one without the bends
};

// The weighted Gauss-Newton system of a graph: H = sum w J^T J, g = sum w J^T r over the factors'
// residuals r = W e and their derivatives J. Its structure is found once; the graph must outlive
// it. Weights: one a factor, 0 leaves it out.
class NormalEquations {
 public:
  explicit NormalEquations(const FactorGraph& graph);

  // kHeadings: of the factors' yaw alone, as if their positions agreed. kPositions: headings held.
  // Either is a linear problem (Carlone et al., "A linear approximation for graph-based
  // simultaneous localization and mapping", RSS 2011).
  enum class Unknowns { kAll, kHeadings, kPositions };
  void Linearise(const std::vector<Pose2>& T_map_vertex, Unknowns unknowns = Unknowns::kAll);
  double SquaredResidual(std::size_t factor) const {
    return factors_[factor].residual.squaredNorm();
  }

  // H of the last linearisation, its diagonal times 1 + damping. False where that is not positive
  // definite: some vertex is tied to nothing.
  bool Factorize(const std::vector<double>& weights, double damping = 0.0);
  // H of Newton for losses whose weight is their first derivative by |r|^2 and whose second one is
  // bends (Triggs et al., "Bundle adjustment - a modern synthesis", 2000, section 4.3). Where
  // losses bend down too far it is not positive definite: false.
  bool FactorizeNewton(const std::vector<double>& weights, const std::vector<double>& bends);

  // -H^-1 g: g of the last linearisation, H of the last factorisation.
  NewtonStep Step(const std::vector<double>& weights) const;
  // -H^-1 g, both of the last linearisation, by conjugate gradients that the last factorisation
  // preconditions: the nearer its H, the fewer iterations, each as much as a Step(). They end where
  // H turns out not to be positive definite (Steihaug, "The conjugate gradient method and trust
  // regions in large scale optimization", SIAM J. Numer. Anal. 1983).
  NewtonStep IteratedStep(const std::vector<double>& weights,
                          const std::vector<double>& bends,
                          int max_iterations) const;

  // From H of the last factorisation, undamped, and J of the last linearisation.
  GraphCovariance Covariance(int newest) const;
  // The same of every vertex (three rows each) with this one (three columns).
  Eigen::MatrixXd CovarianceWith(int vertex) const;

 private:
  struct Linearised {
    Eigen::Vector3d residual;
    std::array<Eigen::Matrix3d, 3> J;  // one an end; zero for the fixed vertex
  };
  // The vertices that a factor ties together: i, j, mounting; kMap: not there. And where the blocks
  // of H of two of them, (0, 1), (0, 2), (1, 2), stand off its diagonal; -1: nowhere.
  struct Ends {
    std::array<int, 3> vertex;
    std::array<int, 3> block;
  };
  static std::vector<Ends> EndsOf(const FactorGraph& graph);
  static BlockPattern PatternOf(const std::vector<Ends>& ends);
  bool IsFree(int vertex) const { return vertex != kMap && vertex != graph_.fixed_vertex; }
  BlockMatrix Hessian(const std::vector<double>& weights, const std::vector<double>& bends) const;
  Eigen::VectorXd Gradient(const std::vector<double>& weights) const;
  // H x of the last linearisation.
  Eigen::VectorXd Multiply(const std::vector<double>& weights,
                           const std::vector<double>& bends,
                           const Eigen::VectorXd& x) const;

  const FactorGraph& graph_;
  const std::vector<Ends> ends_;  // one a factor
  BlockCholesky cholesky_;
  std::vector<Linearised> factors_;
  Eigen::Vector3d held_ = Eigen::Vector3d::Zero();  // 1 for x, y, yaw that are no unknowns
};

}  // namespace seastitch
