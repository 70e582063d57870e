#include "mapper/navigation/aiding/stamp_offset.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace seastitch {
namespace {

// Time constant with which old differences are forgotten [s]: a delay may change.
constexpr double kMemoryS = 200.0;
// Limit of the weight of one difference, in squared sigmas: it may have another cause.
constexpr double kMostByOne = 25.0;
constexpr double kComponents = 3.0;
// Successive differences share a sample and are correlated: their weight is divided by this.
constexpr double kCorrelation = 2.0;
constexpr double kSuspectSigma = 4.0;
constexpr double kSuspectS = 0.01;
// Differences over less time than this may be of one manoeuvre and share an error.
constexpr double kManoeuvreS = 30.0;

}  // namespace

void StampOffset::Add(const Difference& difference, double sigma, double drift_sigma, double dt_s) {
  const double keep = std::exp(-dt_s / kMemoryS);
  differences_ = keep * differences_ + 1.0;
  seen_s_ = keep * seen_s_ + dt_s;
  drift_sigma_ = drift_sigma;
  const double most2 = kMostByOne * (sigma * sigma + drift_sigma * drift_sigma);
  for (std::size_t i = 0; i < kDelays; ++i) {
    const Eigen::Vector3d d = difference(DelayS(i));
    const double weight = std::min(1.0, most2 / d.squaredNorm()) / (sigma * sigma);
    Sums& sums = sums_[i];
    sums.square = keep * sums.square + weight * d.squaredNorm();
    sums.weight = keep * sums.weight + weight;
    sums.drift = keep * sums.drift + weight * d;
  }
  Find();
}

// Cost of the data, minimised over the drift, which has a prior.
double StampOffset::DataCost(const Sums& sums) const {
  const double drift_variance = drift_sigma_ * drift_sigma_;
  if (!(drift_variance > 0.0)) return sums.square;
  return sums.square - sums.drift.squaredNorm() / (sums.weight + 1.0 / drift_variance);
}

double StampOffset::Cost(std::size_t i) const {
  const double prior = DelayS(i) / kPriorS;
  return prior * prior + DataCost(sums_[i]) / kCorrelation;
}

// Factor by which the remaining cost is larger than by the sensors' noise; at least 1.
double StampOffset::Noisier(std::size_t i) const {
  return std::max(1.0, DataCost(sums_[i]) / (kComponents * differences_));
}

// Finds the minimum by a parabola through the smallest cost and its neighbours. Where the cost is
// flat, the noise bends it from one delay to the next: sigma then is half the width in which it
// rises by 1.
void StampOffset::Find() {
  const std::size_t best = Best();
  delay_s_ = 0.0;
  sigma_s_ = kPriorS;
  // the delay may be longer than the longest that is tried
  if (best == 0 || best == kDelays - 1) return;
  const double before = Cost(best - 1);
  const double least = Cost(best);
  const double after = Cost(best + 1);
  const double bend = before - 2.0 * least + after;
  if (!(bend > 0.0)) return;
  const double noisier = Noisier(best);
  delay_s_ = DelayS(best) + kStepS * std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
  sigma_s_ = kStepS * std::sqrt(2.0 * noisier / bend);
  const auto is_near = [&](std::size_t i) { return Cost(i) < least + noisier; };
  std::size_t first = 0;
  std::size_t last = kDelays - 1;
  while (!is_near(first)) ++first;
  while (!is_near(last)) --last;
  if (last > first + 1) sigma_s_ = std::max(sigma_s_, 0.5 * (DelayS(last) - DelayS(first)));
}

std::size_t StampOffset::Best() const {
  std::size_t best = kEachWay;
  double least = Cost(best);
  for (std::size_t i = 0; i < kDelays; ++i) {
    const double cost = Cost(i);
    if (!(cost < least)) continue;
    best = i;
    least = cost;
  }
  return best;
}

// Also by the likelihood ratio: a delay that explains hardly more than none is none.
bool StampOffset::IsSuspected() const {
  if (!(seen_s_ > 0.0)) return false;
  const double few = 1.0 + kManoeuvreS / seen_s_;
  if (!(std::abs(delay_s_) > std::max(kSuspectS, kSuspectSigma * sigma_s_ * std::sqrt(few))))
    return false;
  if (std::abs(delay_s_) < kStepS) return true;  // finer than the grid
  const std::size_t best = Best();
  return Cost(kEachWay) - Cost(best) > kSuspectSigma * kSuspectSigma * few * Noisier(best);
}

}  // namespace seastitch
