#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// How the robust factors weigh, all together, at one stage of the solution. Plain factors are
// always squares.
struct Losses {
  std::optional<double> mu;  // of GraduatedLoss; none: squares
  std::vector<bool> active;  // one a factor; not active: no weight
  // As how many independent factors, at most, a correlated group counts.
  double effective_size = kIndependent;

  static constexpr double kIndependent = std::numeric_limits<double>::infinity();

  // Of factor k with the squared residual s.
  double Value(const Factor& factor, std::size_t k, double s) const;
  // Its first derivative by s: the factor's weight.
  double Weight(const Factor& factor, std::size_t k, double s) const;

 private:
  // Of its own statement, that a factor counts.
  double Share(const Factor& factor, std::size_t k) const;
};

// Minimises the sum of the losses of a graph with Ceres. The graph must outlive it.
class CeresMinimiser {
 public:
  explicit CeresMinimiser(const FactorGraph& graph);
  ~CeresMinimiser();
  CeresMinimiser(const CeresMinimiser&) = delete;
  CeresMinimiser& operator=(const CeresMinimiser&) = delete;

  void StartFrom(const std::vector<Pose2>& T_map_vertex);
  // From where it stands. True: it stands at a minimum. False: it ran out of iterations, no step
  // led down, or the cost is no number.
  bool Minimise(const Losses& losses, int max_iterations, double tolerance);

  std::vector<Pose2> poses() const;
  // Where it stands, one a factor.
  std::vector<double> Weights(const Losses& losses) const;

 private:
  class Problem;
  const FactorGraph& graph_;
  const std::unique_ptr<Problem> problem_;
};

}  // namespace seastitch
