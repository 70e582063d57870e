#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/survey_noise.hpp"
#include "mapper/noise/closure_statistics.hpp"
#include "mapper/noise/variance_components.hpp"

namespace seastitch {

// The values of an estimate, without their sigmas.
VarianceComponents ComponentsOf(const NoiseEstimate& estimate);

// Estimator of the survey's four variance components (VarianceComponents: sounding noise,
// correlated height error, random walks of position and heading) from its accepted closures:
// maximum a posteriori of the product of their likelihoods and the prior. Each closure's
// log-likelihood is bounded, so that no outlier decides alone. For given closures the estimate does
// not depend on their order. Pure.
class NoiseEstimator {
 public:
  using PairKey = std::pair<SubmapId, SubmapId>;  // target, source

  explicit NoiseEstimator(const VarianceComponents& prior);

  // Adds an accepted closure; replaces an earlier one of the same pair.
  void Add(ClosureStatistics statistics);
  // Removes a closure that is no longer accepted; does nothing without one.
  void Remove(SubmapId target, SubmapId source);

  // Estimate with its sigmas, for reports.
  const NoiseEstimate& estimate() const { return estimate_; }
  // Values to register with: those of estimate(), or the prior without a closure.
  const VarianceComponents& components() const { return components_; }
  // Statistics of a closure; null where the pair has none.
  const ClosureStatistics* Find(SubmapId target, SubmapId source) const;

  // Records that the graph gets this closure with its covariance under the present components().
  void StateAnew(const PairKey& pair);
  // Returns the closures whose covariance under the present components() differs by more than 10 %
  // in the sigma of any direction from the one that was last recorded for the graph. Records the
  // present one for each: the caller updates the graph.
  std::vector<const ClosureStatistics*> TakeRestated();

  // Closures that are outdated (ClosureStatistics::IsOutdated()) under components(), as of the last
  // call of TakeRestated().
  const std::set<PairKey>& outdated() const { return outdated_; }
  // All closures, by pair.
  const std::map<PairKey, ClosureStatistics>& closures() const { return closures_; }
  // Revision of the estimate: grows with every Add() and Remove().
  std::int64_t revision() const { return revision_; }

 private:
  // One overlap's estimate of sounding_variance_ratio.
  struct Weighted {
    double ratio;   // residual variance of a sounding divided by the prior's
    double weight;  // its degrees of freedom
    auto operator<=>(const Weighted&) const = default;
  };

  static std::optional<Weighted> SoundingsOf(const ClosureStatistics& closure);
  // Weighted quantiles of soundings_: the ratios with the fractions `parts` (rising, 0 to 1) of the
  // weight below them. weight: of all.
  std::array<double, 3> Quantiles(const std::array<double, 3>& parts, double weight) const;
  void Include(const ClosureStatistics& closure);
  void Exclude(const ClosureStatistics& closure);
  // Computes estimate_ and components_ from the sums.
  void Pool();
  ComponentEstimate PoolSoundings() const;

  const VarianceComponents prior_;
  // By the index of each axis.
  const std::vector<double> error_ratio_log_prior_;
  const std::vector<double> position_walk_log_prior_;
  const std::vector<double> heading_walk_log_prior_;
  std::map<PairKey, ClosureStatistics> closures_;
  // Sums over all closures, so that another closure costs the same however many there are. They are
  // integers, in steps of kLogLikelihoodStep, so that they are exact in any order.
  std::vector<std::int64_t> log_likelihood_;
  std::vector<Weighted> soundings_;  // by increasing ratio; with the prior
  std::int64_t revision_ = 0;
  // The length of the way that components_ has travelled, as changes of logarithms, and for each
  // closure the length before which its sigmas cannot have changed by 10 %. So TakeRestated() looks
  // at few closures, however many there are.
  double path_ = 0.0;
  double untravelled_ = 0.0;  // since the last TakeRestated()
  std::multimap<double, PairKey> looks_;
  std::set<PairKey> outdated_;
  NoiseEstimate estimate_;
  VarianceComponents components_;
};

}  // namespace seastitch
