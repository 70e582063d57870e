#include "mapper/navigation/aiding/stuck_gyro_watch.hpp"

namespace seastitch {
namespace {

// Time for which rates must repeat [s]: noise repeats by chance for less.
constexpr double kStuckS = 0.5;
// Tolerance of equal rates, for the rounding by interpolation between samples.
constexpr double kSameRateRadps = 1e-12;
// Longest time over which differences are summed [s]: beyond it slow errors of the device add up.
constexpr double kLongestSpanS = 10.0;

}  // namespace

void StuckGyroWatch::AddRate(const Eigen::Vector3d& rate_radps, double dt_s) {
  const bool repeats = (rate_radps - last_rate_radps_).norm() < kSameRateRadps;
  last_rate_radps_ = rate_radps;
  if (repeats) {
    repeated_s_ += dt_s;
    return;
  }
  repeated_s_ = 0.0;
  are_stuck_ = false;
  Interrupt();
}

void StuckGyroWatch::AddDifference(const Eigen::Vector3d& difference_rad,
                                   double dt_s,
                                   double turned_rad) {
  if (span_s_ >= kLongestSpanS) Interrupt();
  if (repeated_s_ < span_s_ + dt_s - 1e-6) return;
  sum_rad_ += difference_rad;
  if (difference_rad.norm() > largest_rad_.norm()) largest_rad_ = difference_rad;
  span_s_ += dt_s;
  turned_rad_ += turned_rad;
}

void StuckGyroWatch::Interrupt() {
  sum_rad_.setZero();
  largest_rad_.setZero();
  span_s_ = turned_rad_ = 0.0;
}

void StuckGyroWatch::Judge(double limit_rad) {
  if (repeated_s_ < kStuckS || span_s_ == 0.0) return;
  if (sum_rad_.norm() > limit_rad && (sum_rad_ - largest_rad_).norm() > limit_rad)
    are_stuck_ = true;
}

}  // namespace seastitch
