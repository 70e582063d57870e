#include "mapper/noise/noise_estimator.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace seastitch {
namespace {

// Sigma of the logarithm in the priors of all components except the white noise: a factor of 2.7.
constexpr double kPriorLogSigma = 1.0;
// Weight of the prior of the white noise, in degrees of freedom.
constexpr double kPriorDegrees = 10.0;
constexpr double kRestatedSigmaRatio = 1.1;
constexpr double kRestatedVarianceRatio = kRestatedSigmaRatio * kRestatedSigmaRatio;
const double kRestatedLog = std::log(kRestatedVarianceRatio);
constexpr double kRounding = 0.999;
constexpr double kLogLikelihoodStep = 1.0 / (1 << 24);
constexpr double kMostLogLikelihood = 1e6;  // larger differences change no result

std::int64_t InSteps(float value) {
  const double bounded =
      std::clamp(static_cast<double>(value), -kMostLogLikelihood, kMostLogLikelihood);
  return std::llround(bounded / kLogLikelihoodStep);
}

// -2 ln of the prior at each index of the axis.
std::vector<double> LogPriorOf(const ComponentAxis& axis, double prior) {
  const double nearest = std::clamp(prior, axis.At(0), axis.At(axis.size - 1));
  std::vector<double> log_prior;
  for (std::size_t i = 0; i < axis.size; ++i)
    log_prior.push_back(std::pow(std::log(axis.At(i) / nearest) / kPriorLogSigma, 2));
  return log_prior;
}

// Minimum of a profile between the nodes and its width, by a parabola through three nodes. profile:
// -2 ln L along the axis, minimised over the other components.
ComponentEstimate Refine(const ComponentAxis& axis,
                         const std::vector<double>& profile,
                         double configured) {
  const auto least = std::min_element(profile.begin(), profile.end());
  const auto i = static_cast<std::size_t>(least - profile.begin());
  if (i == 0) return {configured, axis.At(i), kPriorLogSigma, RangeEnd::kLow};
  if (i == axis.size - 1) return {configured, axis.At(i), kPriorLogSigma, RangeEnd::kHigh};
  const double step = std::log(2.0);
  const double curvature = profile[i - 1] - 2.0 * profile[i] + profile[i + 1];
  // A flat profile leaves the prior's sigma.
  if (!(curvature > 0.0)) return {configured, axis.At(i), kPriorLogSigma};
  const double offset = 0.5 * (profile[i - 1] - profile[i + 1]) / curvature;
  const double sigma = step * std::sqrt(2.0 / curvature);
  return {configured, axis.At(i) * std::exp2(offset), std::min(sigma, kPriorLogSigma)};
}

// The change of the logarithm of the variance in the direction that changes most.
double LogChange(const ClosureStatistics::SmallMatrix& from,
                 const ClosureStatistics::SmallMatrix& to) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<ClosureStatistics::SmallMatrix> ratios(
      to, from, Eigen::EigenvaluesOnly);
  const double change = std::max(std::abs(std::log(ratios.eigenvalues().minCoeff())),
                                 std::abs(std::log(ratios.eigenvalues().maxCoeff())));
  return std::isfinite(change) ? change : std::numeric_limits<double>::infinity();
}

// Change of the logarithm from one positive figure to another; else infinite, where they differ.
double LogChange(double from, double to) {
  if (from == to) return 0.0;
  return from > 0.0 && to > 0.0 ? std::abs(std::log(from / to))
                                : std::numeric_limits<double>::infinity();
}

// The largest change of the logarithm of a figure.
double LogChange(const VarianceComponents& from, const VarianceComponents& to) {
  return std::max({LogChange(from.sounding_variance_ratio, to.sounding_variance_ratio),
                   LogChange(from.correlated_error_ratio, to.correlated_error_ratio),
                   LogChange(from.position_walk, to.position_walk),
                   LogChange(from.heading_walk, to.heading_walk)});
}

// The largest change of the logarithm of a part of the closure's covariance. A covariance is a sum
// over components, so that in no direction it changes by a larger factor than the component that
// changes most.
double LogChangeOfVariance(const ClosureStatistics& closure,
                           const VarianceComponents& from,
                           const VarianceComponents& to) {
  return std::max(
      {LogChange(closure.scatter.VarianceUnder(from), closure.scatter.VarianceUnder(to)),
       2.0 * LogChange(from.correlated_error_ratio, to.correlated_error_ratio),
       2.0 * LogChange(from.position_walk, to.position_walk),
       2.0 * LogChange(from.heading_walk, to.heading_walk)});
}

}  // namespace

VarianceComponents ComponentsOf(const NoiseEstimate& estimate) {
  return {estimate.sounding_variance_ratio.value,
          estimate.correlated_error_ratio.value,
          estimate.position_walk.value,
          estimate.heading_walk.value};
}

NoiseEstimator::NoiseEstimator(const VarianceComponents& prior)
    : prior_(prior),
      error_ratio_log_prior_(LogPriorOf(kErrorRatioAxis, prior.correlated_error_ratio)),
      position_walk_log_prior_(LogPriorOf(kPositionWalkAxis, prior.position_walk)),
      heading_walk_log_prior_(LogPriorOf(kHeadingWalkAxis, prior.heading_walk)),
      log_likelihood_(LikelihoodTable::kSize, 0),
      soundings_{{prior.sounding_variance_ratio, kPriorDegrees}} {
  Pool();
}

void NoiseEstimator::Add(ClosureStatistics statistics) {
  const auto [known, is_new] =
      closures_.try_emplace({statistics.target, statistics.source}, statistics);
  if (!is_new) {
    Exclude(known->second);
    known->second = std::move(statistics);
  }
  Include(known->second);
  looks_.emplace(path_, known->first);
  Pool();
}

void NoiseEstimator::Remove(SubmapId target, SubmapId source) {
  const auto found = closures_.find({target, source});
  if (found == closures_.end()) return;
  Exclude(found->second);
  outdated_.erase(found->first);
  closures_.erase(found);
  Pool();
}

std::optional<NoiseEstimator::Weighted> NoiseEstimator::SoundingsOf(
    const ClosureStatistics& closure) {
  const SoundingScatter& s = closure.scatter;
  if (!(s.degrees > 1.0 && s.prior_variance > 0.0 && s.residual_variance > 0.0))
    return std::nullopt;
  return Weighted{s.residual_variance / s.prior_variance, s.degrees};
}

void NoiseEstimator::Include(const ClosureStatistics& closure) {
  const auto& values = closure.likelihood.values();
  for (std::size_t i = 0; i < values.size(); ++i) log_likelihood_[i] += InSteps(values[i]);
  if (const auto soundings = SoundingsOf(closure))
    soundings_.insert(std::upper_bound(soundings_.begin(), soundings_.end(), *soundings),
                      *soundings);
}

void NoiseEstimator::Exclude(const ClosureStatistics& closure) {
  const auto& values = closure.likelihood.values();
  for (std::size_t i = 0; i < values.size(); ++i) log_likelihood_[i] -= InSteps(values[i]);
  if (const auto soundings = SoundingsOf(closure))
    soundings_.erase(std::lower_bound(soundings_.begin(), soundings_.end(), *soundings));
}

std::array<double, 3> NoiseEstimator::Quantiles(const std::array<double, 3>& parts,
                                                double weight) const {
  std::array<double, 3> quantiles{};
  quantiles.fill(soundings_.back().ratio);
  std::size_t k = 0;
  double below = 0.0;
  for (const Weighted& w : soundings_) {
    below += w.weight;
    for (; k < parts.size() && below >= parts[k] * weight; ++k) quantiles[k] = w.ratio;
    if (k == parts.size()) break;
  }
  return quantiles;
}

const ClosureStatistics* NoiseEstimator::Find(SubmapId target, SubmapId source) const {
  const auto found = closures_.find({target, source});
  return found == closures_.end() ? nullptr : &found->second;
}

void NoiseEstimator::StateAnew(const PairKey& pair) {
  ClosureStatistics& closure = closures_.at(pair);
  closure.stated_under = closure.Applicable(components_);
}

std::vector<const ClosureStatistics*> NoiseEstimator::TakeRestated() {
  path_ += std::exchange(untravelled_, 0.0);
  std::set<PairKey> due;
  const auto end = looks_.upper_bound(path_);
  for (auto look = looks_.begin(); look != end; ++look) due.insert(look->second);
  looks_.erase(looks_.begin(), end);
  std::vector<const ClosureStatistics*> restated;
  for (const PairKey& key : due) {
    const auto found = closures_.find(key);
    if (found == closures_.end()) continue;
    ClosureStatistics& closure = found->second;
    const VarianceComponents now = closure.Applicable(components_);
    double change = LogChangeOfVariance(closure, closure.stated_under, now);
    if (change > kRestatedLog)
      change =
          LogChange(closure.CovarianceUnder(closure.stated_under), closure.CovarianceUnder(now));
    if (change > kRestatedLog) {
      closure.stated_under = now;
      restated.push_back(&closure);
      change = 0.0;
    }
    if (closure.IsOutdated(components_))
      outdated_.insert(key);
    else
      outdated_.erase(key);
    const double until =
        std::min(0.5 * (kRestatedLog - change), closure.LogUntilOutdated(components_));
    looks_.emplace(path_ + std::max(0.0, kRounding * until), key);
  }
  return restated;
}

// A weighted median, so that a wreck or fish in one overlap does not change the noise of the
// others.
ComponentEstimate NoiseEstimator::PoolSoundings() const {
  double weight = 0.0;
  double squares = 0.0;
  for (const Weighted& w : soundings_) {
    weight += w.weight;
    squares += w.weight * w.weight;
  }
  // Error of the median, from the quantiles at one sigma of the count, for the equivalent number of
  // equal weights.
  const double apart = 0.5 / std::sqrt(weight * weight / squares);
  const auto [low, median, high] =
      Quantiles({std::max(0.0, 0.5 - apart), 0.5, std::min(1.0, 0.5 + apart)}, weight);
  ComponentEstimate estimate{prior_.sounding_variance_ratio, median, kPriorLogSigma};
  if (soundings_.size() >= 3)
    estimate.log_sigma = std::clamp(0.5 * std::log(high / low), 0.01, kPriorLogSigma);
  return estimate;
}

void NoiseEstimator::Pool() {
  ++revision_;
  constexpr double kNothing = 1e300;
  std::vector<double> by_s(kErrorRatioAxis.size, kNothing);
  std::vector<double> by_q(kPositionWalkAxis.size, kNothing);
  std::vector<double> by_p(kHeadingWalkAxis.size, kNothing);
  for (std::size_t s = 0; s < by_s.size(); ++s) {
    for (std::size_t q = 0; q < by_q.size(); ++q) {
      for (std::size_t p = 0; p < by_p.size(); ++p) {
        const auto steps = static_cast<double>(log_likelihood_[LikelihoodTable::Index(s, q, p)]);
        const double value = steps * kLogLikelihoodStep + error_ratio_log_prior_[s] +
                             position_walk_log_prior_[q] + heading_walk_log_prior_[p];
        by_s[s] = std::min(by_s[s], value);
        by_q[q] = std::min(by_q[q], value);
        by_p[p] = std::min(by_p[p], value);
      }
    }
  }
  estimate_.closures = static_cast<int>(closures_.size());
  estimate_.sounding_variance_ratio = PoolSoundings();
  estimate_.correlated_error_ratio = Refine(kErrorRatioAxis, by_s, prior_.correlated_error_ratio);
  estimate_.position_walk = Refine(kPositionWalkAxis, by_q, prior_.position_walk);
  estimate_.heading_walk = Refine(kHeadingWalkAxis, by_p, prior_.heading_walk);
  const VarianceComponents before = components_;
  components_ = closures_.empty() ? prior_ : ComponentsOf(estimate_);
  untravelled_ += LogChange(before, components_);
}

}  // namespace seastitch
