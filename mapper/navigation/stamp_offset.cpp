#include "mapper/navigation/stamp_offset.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace seastitch {
namespace {

// What lies back further than this counts for little: a delay may change.
constexpr double kMemoryS = 200.0;
// No one difference counts for more, in squares of sigma: it may have another cause.
constexpr double kMostByOne = 25.0;
constexpr double kComponents = 3.0;
// Differences that follow each other share a sample: they count for so much less.
constexpr double kCorrelation = 2.0;
constexpr double kSuspectSigma = 4.0;
constexpr double kSuspectS = 0.01;
// What has been seen for less may be one manoeuvre, whose differences have an error alike.
constexpr double kManoeuvreS = 30.0;

}  // namespace

void StampOffset::Add(const Difference& difference, double sigma, double drift_sigma, double dt_s) {
  const double keep = std::exp(-dt_s / kMemoryS);
  differences_ = keep * differences_ + 1.0;
  seen_s_ = keep * seen_s_ + dt_s;
  drift_sigma_ = drift_sigma;
  for (std::size_t i = 0; i < kDelays; ++i) {
    const Eigen::Vector3d d = difference(DelayS(i));
    const double most2 = kMostByOne * (sigma * sigma + drift_sigma * drift_sigma);
    const double weight = std::min(1.0, most2 / d.squaredNorm()) / (sigma * sigma);
    Sums& sums = sums_[i];
    sums.square = keep * sums.square + weight * d.squaredNorm();
    sums.weight = keep * sums.weight + weight;
    sums.drift = keep * sums.drift + weight * d;
  }
  Find();
}

// Of the drift that explains most, which costs something itself.
double StampOffset::DataCost(const Sums& sums) const {
  const double drift_variance = drift_sigma_ * drift_sigma_;
  if (!(drift_variance > 0.0)) return sums.square;
  return sums.square - sums.drift.squaredNorm() / (sums.weight + 1.0 / drift_variance);
}

double StampOffset::Cost(std::size_t i) const {
  const double prior = DelayS(i) / kPriorS;
  return prior * prior + DataCost(sums_[i]) / kCorrelation;
}

// The least cost lies on a parabola through the least of the row and its neighbours. Where even the
// best delay leaves more than the sensors' noise, they are noisier than they should be.
void StampOffset::Find() {
  std::size_t best = kEachWay;
  for (std::size_t i = 0; i < kDelays; ++i)
    if (Cost(i) < Cost(best)) best = i;
  delay_s_ = 0.0;
  sigma_s_ = kPriorS;
  if (best == 0 || best == kDelays - 1) return;  // it may be longer than any that is tried
  const double before = Cost(best - 1);
  const double after = Cost(best + 1);
  const double bend = before - 2.0 * Cost(best) + after;
  const double noisier = std::max(1.0, DataCost(sums_[best]) / (kComponents * differences_));
  if (!(bend > 0.0)) return;
  delay_s_ = DelayS(best) + kStepS * std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
  sigma_s_ = kStepS * std::sqrt(2.0 * noisier / bend);
}

bool StampOffset::IsSuspected() const {
  if (!(seen_s_ > 0.0)) return false;
  const double sigma_s = sigma_s_ * std::sqrt(1.0 + kManoeuvreS / seen_s_);
  return std::abs(delay_s_) > std::max(kSuspectS, kSuspectSigma * sigma_s);
}

}  // namespace seastitch
