#pragma once

#include <cstdint>
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

// Estimator of the variance components of a survey from its accepted closures: maximum of the
// product of their bounded likelihoods and the prior. The estimate depends on the set of closures,
// not on their order. Pure.
class NoiseEstimator {
 public:
  using PairKey = std::pair<SubmapId, SubmapId>;  // target, source

  explicit NoiseEstimator(const VarianceComponents& prior);

  // Adds an accepted closure; replaces an earlier one of the same pair.
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
  // Another where anything of the above may be another.
  std::int64_t revision() const { return revision_; }

 private:
  // Ratio of variances of an overlap's soundings, with its degrees of freedom.
  struct Weighted {
    double ratio;
    double weight;
    auto operator<=>(const Weighted&) const = default;
  };

  static std::optional<Weighted> SoundingsOf(const ClosureStatistics& closure);
  static double Quantile(const std::vector<Weighted>& sorted, double part);
  void Include(const ClosureStatistics& closure);
  void Exclude(const ClosureStatistics& closure);
  void Pool();
  ComponentEstimate PoolSoundings() const;

  const VarianceComponents prior_;
  std::map<PairKey, ClosureStatistics> closures_;
  // Sums over all closures are kept, so that one more costs what it does and not what all do: in
  // whole steps of kLogLikelihoodStep, which makes them exact in any order.
  std::vector<std::int64_t> log_likelihood_;
  std::vector<Weighted> soundings_;  // by rising ratio; with the prior
  std::int64_t revision_ = 0;
  NoiseEstimate estimate_;
  VarianceComponents components_;
};

}  // namespace seastitch
