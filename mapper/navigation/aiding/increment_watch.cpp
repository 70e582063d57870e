#include "mapper/navigation/aiding/increment_watch.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

void IncrementWatch::Add(Time t, const Eigen::Vector3d& difference, double sigma) {
  last_.push_back({difference, sigma});
  if (last_.size() > kWindow) last_.pop_front();
  // After a step of the sensor itself, its differences are no evidence against the other sensor.
  if (!StepIsSure() && WindowDiffers()) {
    last_going_on_ = t;
    ForgetStep();
    return;
  }
  if (GoesOn(t)) return;
  if (!(difference.norm() <= gate_ * sigma))
    AddStep(t, last_.back());
  else
    ++since_step_;
}

// True if the window's differences deviate by more than any single one of them explains.
bool IncrementWatch::WindowDiffers() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double variance = 0.0;
  const Difference* largest = &last_.front();
  for (const Difference& difference : last_) {
    sum += difference.value;
    variance += difference.sigma * difference.sigma;
    if (difference.value.norm() > largest->value.norm()) largest = &difference;
  }
  const double limit = gate_ * std::sqrt(variance);
  return sum.norm() > limit && (sum - largest->value).norm() > limit;
}

void IncrementWatch::AddStep(Time t, const Difference& difference) {
  if (!step_) {
    step_ = Eigen::Vector3d::Zero();
    step_sigma_ = 0.0;
    step_time_ = t;
  }
  const double before = step_->norm();
  *step_ += difference.value;
  step_sigma_ = Hypotenuse(step_sigma_, difference.sigma);
  since_step_ = 0;
  // A step counts as taken back if it is smaller than the noise or than this part of itself before.
  constexpr double kBack = 0.2;
  if (step_->norm() <= gate_ * step_sigma_ || step_->norm() <= kBack * before) step_.reset();
}

void IncrementWatch::ForgetStep() {
  step_.reset();
  since_step_ = 0;
}

bool IncrementWatch::GoesOn(Time t) const {
  return last_going_on_ && ToSeconds(t - *last_going_on_) < quiet_s_;
}

}  // namespace seastitch
