#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/survey_noise.hpp"
#include "mapper/noise/closure_statistics.hpp"
#include "mapper/noise/variance_components.hpp"

namespace seastitch {

VarianceComponents ComponentsOf(const NoiseEstimate& estimate);

// The variance components of a survey, pooled over its accepted closures: the maximum of the
// product of what each says, bounded, and of the prior. It depends on what closures there are,
// not on their order. Pure.
class NoiseEstimator {
 public:
  using PairKey = std::pair<SubmapId, SubmapId>;  // target, source

  explicit NoiseEstimator(const VarianceComponents& prior) : prior_(prior) { Pool(); }

  // A closure that is accepted, in place of what its pair said before.
  void Add(ClosureStatistics statistics);
  // One that is no longer.
  void Remove(SubmapId target, SubmapId source);

  const NoiseEstimate& estimate() const { return estimate_; }
  const VarianceComponents& components() const { return components_; }
  const ClosureStatistics* Find(SubmapId target, SubmapId source) const;

  // States a closure under the present figures, as the graph is about to get it.
  void StateAnew(const PairKey& pair);
  // The other closures whose covariance under the present figures differs from what the graph has
  // by more than a tenth in a sigma; the graph is taken to have them from now on.
  std::vector<const ClosureStatistics*> TakeRestated();

  // All, by pair.
  const std::map<PairKey, ClosureStatistics>& closures() const { return closures_; }

 private:
  void Pool();
  ComponentEstimate PoolSoundings() const;

  const VarianceComponents prior_;
  std::map<PairKey, ClosureStatistics> closures_;
  NoiseEstimate estimate_;
  VarianceComponents components_;
};

}  // namespace seastitch
