#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "optimizer/solver/factor_graph.hpp"

namespace seastitch {

// Losses of all factors at one stage of the solution.
struct Losses {
  std::optional<double> mu;   // of GraduatedLoss, for robust factors; absent: plain squares
  std::vector<double> share;  // fraction of each factor's information that is used, 0 to 1

  // Loss of factor k, where s is its squared residual.
  double Value(const Factor& factor, std::size_t k, double s) const {
    return share[k] * (mu && factor.IsRobust() ? factor.loss.Value(s, *mu) : s);
  }
  // Its derivative with respect to s: the factor's weight.
  double Weight(const Factor& factor, std::size_t k, double s) const {
    return share[k] * (mu && factor.IsRobust() ? factor.loss.Weight(s, *mu) : 1.0);
  }
};

// Minimises the sum of the losses of a factor graph with Ceres. The graph must outlive it.
class CeresMinimiser {
 public:
  // on_step is called after every iteration of every minimisation; may be empty.
  explicit CeresMinimiser(const FactorGraph& graph, std::function<void()> on_step = {});
  ~CeresMinimiser();
  CeresMinimiser(const CeresMinimiser&) = delete;
  CeresMinimiser& operator=(const CeresMinimiser&) = delete;

  // Improves the poses, one per vertex. tolerance: relative decrease of the cost that ends the
  // iteration. True: converged. False: max_iterations reached, no step lowered the cost, or the
  // cost is not finite.
  bool Minimise(const Losses& losses,
                int max_iterations,
                double tolerance,
                std::vector<Pose2>* T_map_vertex);

 private:
  class Problem;
  const std::unique_ptr<Problem> problem_;
};

}  // namespace seastitch
