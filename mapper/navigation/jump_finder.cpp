#include "mapper/navigation/jump_finder.hpp"
#include "common/core/median.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace seastitch {
namespace {

constexpr std::size_t kWindow = 15;  // positions on either side
constexpr double kWindowS = 5.0;     // and no further
constexpr std::size_t kFewest = 3;   // positions on either side
constexpr double kGate = 6.0;        // sigmas: one in 70 million
// Half of a jump lies between two positions: what slides is no jump.
constexpr double kSharp = 0.5;
constexpr std::size_t kNoiseSteps = 200;
// Variance of a median of normal numbers over that of their mean.
constexpr double kMedianVariance = 1.57;
constexpr double kSigmaPerMedianStep = 1.0 / (0.6745 * 1.4142);

Eigen::Vector2d MedianOf(const std::vector<Eigen::Vector2d>& points) {
  std::vector<double> x, y;
  for (const Eigen::Vector2d& p : points) {
    x.push_back(p.x());
    y.push_back(p.y());
  }
  return {Median(std::move(x)), Median(std::move(y))};
}

}  // namespace

void JumpFinder::Add(const Position& position) {
  Entry entry{position, Eigen::Vector2d::Zero()};
  if (last_) {
    const Position& from = last_->position;
    const double dt_s = ToSeconds(position.time - from.time);
    const bool known = position.v_mps && from.v_mps && dt_s <= kWindowS;
    const Eigen::Vector2d moved = position.given_m - from.given_m;
    entry.residual_m = last_->residual_m;
    if (known) entry.residual_m += moved - 0.5 * dt_s * (*position.v_mps + *from.v_mps);
  }
  last_ = entry;
  waiting_.push_back(std::move(entry));
}

std::vector<JumpFinder::Steady> JumpFinder::Take(Time now) {
  std::vector<Steady> out;
  while (!waiting_.empty() &&
         (waiting_.size() > kWindow || ToSeconds(now - waiting_.front().position.time) > kWindowS))
    DecideFirst(&out);
  return out;
}

std::vector<JumpFinder::Steady> JumpFinder::Finish() {
  std::vector<Steady> out;
  while (!waiting_.empty()) DecideFirst(&out);
  return out;
}

void JumpFinder::DecideFirst(std::vector<Steady>* out) {
  const Entry first = waiting_.front();
  const Time t = first.position.time;
  if (!before_.empty() && ToSeconds(t - before_.back().position.time) > kWindowS) before_.clear();
  Residuals after;
  for (const Entry& entry : waiting_)
    if (after.size() < kWindow && ToSeconds(entry.position.time - t) <= kWindowS)
      after.push_back(entry.residual_m);
  const double noise_m = Noise();
  waiting_.pop_front();
  if (IsSpike(after, noise_m)) {
    ++spikes_;
    return;
  }
  Steady steady{first.position, {}};
  if (const auto jump_m = JumpBefore(after, noise_m)) {
    steady.jumped = true;
    steady.jump_variance_m2 =
        kMedianVariance * noise_m * noise_m *
        (1.0 / static_cast<double>(before_.size()) + 1.0 / static_cast<double>(after.size()));
    jumps_m_ += *jump_m;
    before_.clear();
  }
  if (!before_.empty()) {
    const Eigen::Vector2d step = first.residual_m - before_.back().residual_m;
    steps_m_.insert(steps_m_.end(), {std::abs(step.x()), std::abs(step.y())});
    while (steps_m_.size() > kNoiseSteps) steps_m_.pop_front();
  }
  steady.steady_m = first.position.given_m - jumps_m_;
  before_.push_back(first);
  while (before_.size() > kWindow || ToSeconds(t - before_.front().position.time) > kWindowS)
    before_.pop_front();
  out->push_back(std::move(steady));
}

std::optional<Eigen::Vector2d> JumpFinder::JumpBefore(const Residuals& after,
                                                      double noise_m) const {
  if (before_.size() < kFewest || after.size() < kFewest) return std::nullopt;
  Residuals earlier;
  for (const Entry& entry : before_) earlier.push_back(entry.residual_m);
  const Eigen::Vector2d jump = MedianOf(after) - MedianOf(earlier);
  if (jump.norm() <= Threshold(after.size(), noise_m)) return std::nullopt;
  // The sharpest step in sight is this one.
  const Eigen::Vector2d direction = jump.normalized();
  const double here_m = direction.dot(after[0] - earlier.back());
  if (here_m < kSharp * jump.norm()) return std::nullopt;
  for (std::size_t i = 1; i < after.size(); ++i)
    if (direction.dot(after[i] - after[i - 1]) > here_m) return std::nullopt;
  return jump;
}

// What follows lies where what came before did, and this one does not.
bool JumpFinder::IsSpike(const Residuals& after, double noise_m) const {
  if (before_.size() < kFewest || after.size() < kFewest + 1) return false;
  Residuals around(after.begin() + 1, after.end());
  const Eigen::Vector2d later = MedianOf(around);
  around.clear();
  for (const Entry& entry : before_) around.push_back(entry.residual_m);
  const Eigen::Vector2d earlier = MedianOf(around);
  const double threshold_m = std::max(min_jump_m_, kGate * noise_m);
  return (later - earlier).norm() < threshold_m && (after[0] - earlier).norm() > threshold_m &&
         (after[0] - later).norm() > threshold_m;
}

double JumpFinder::Threshold(std::size_t after, double noise_m) const {
  const double variance = kMedianVariance * (1.0 / static_cast<double>(before_.size()) +
                                             1.0 / static_cast<double>(after));
  return std::max(min_jump_m_, kGate * noise_m * std::sqrt(variance));
}

// Of one position, each axis, 1 sigma: by what is decided, and by what is in sight.
double JumpFinder::Noise() const {
  std::vector<double> steps(steps_m_.begin(), steps_m_.end());
  for (std::size_t i = 1; i < waiting_.size() && steps.size() < 2 * kWindow; ++i) {
    const Eigen::Vector2d step = waiting_[i].residual_m - waiting_[i - 1].residual_m;
    steps.insert(steps.end(), {std::abs(step.x()), std::abs(step.y())});
  }
  return steps.empty() ? 0.0 : kSigmaPerMedianStep * Median(std::move(steps));
}

}  // namespace seastitch
