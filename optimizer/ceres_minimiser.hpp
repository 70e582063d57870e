#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// How the factors weigh at one stage of the solution.
struct Losses {
  std::optional<double> mu;   // of the GraduatedLoss of robust factors; none: squares
  std::vector<double> share;  // of each factor: fraction of its information that is used

  // Loss of factor k with the squared residual s.
  double Value(const Factor& factor, std::size_t k, double s) const {
    return share[k] * (mu && factor.IsRobust() ? factor.loss.Value(s, *mu) : s);
  }
  // Its first derivative by s: the factor's weight.
  double Weight(const Factor& factor, std::size_t k, double s) const {
    return share[k] * (mu && factor.IsRobust() ? factor.loss.Weight(s, *mu) : 1.0);
  }
};

// Minimises the sum of the losses of a graph with Ceres. The graph must outlive it.
class CeresMinimiser {
 public:
  // on_step is called after every step of every minimisation; may be empty.
  explicit CeresMinimiser(const FactorGraph& graph, std::function<void()> on_step = {});
  ~CeresMinimiser();
  CeresMinimiser(const CeresMinimiser&) = delete;
  CeresMinimiser& operator=(const CeresMinimiser&) = delete;

  // Improves the poses. True: they are at a minimum. False: iterations ran out, no step lowered the
  // cost, or the cost is not finite.
  bool Minimise(const Losses& losses,
                int max_iterations,
                double tolerance,
                std::vector<Pose2>* T_map_vertex);

 private:
  class Problem;
  const std::unique_ptr<Problem> problem_;
};

}  // namespace seastitch
