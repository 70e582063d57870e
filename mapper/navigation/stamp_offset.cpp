#include "mapper/navigation/stamp_offset.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {
namespace {

constexpr double kGate = 6.0;
constexpr double kLongestS = 1.0;
constexpr double kDriftSPerRtS = 2e-4;
// Differences follow one motion and are not independent: they count for so much less.
constexpr double kCorrelation = 2.0;
constexpr double kSuspectSigma = 4.0;
constexpr double kSuspectS = 0.01;

}  // namespace

void StampOffset::Add(const Eigen::Vector3d& difference,
                      const Eigen::Vector3d& slope,
                      double sigma,
                      double dt_s) {
  variance_s2_ = std::min(variance_s2_ + kDriftSPerRtS * kDriftSPerRtS * dt_s, kPriorS * kPriorS);
  const double slope2 = slope.squaredNorm();
  if (!(slope2 > 0.0)) return;
  const double noise = kCorrelation * sigma;
  const double limit2 = noise * noise + slope2 * variance_s2_;
  if (!(difference.squaredNorm() <= kGate * kGate * limit2)) return;
  const double gain = variance_s2_ / (slope2 * variance_s2_ + noise * noise);
  delay_s_ = std::clamp(delay_s_ + gain * slope.dot(difference), -kLongestS, kLongestS);
  variance_s2_ *= 1.0 - gain * slope2;
}

double StampOffset::sigma_s() const { return std::sqrt(variance_s2_); }

bool StampOffset::IsSuspected() const {
  return std::abs(delay_s_) > std::max(kSuspectS, kSuspectSigma * sigma_s());
}

}  // namespace seastitch
