#include "mapper/navigation/ins/jump_finder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kWindow = 15;  // positions on either side
constexpr double kWindowS = 5.0;     // limit of the window's duration on either side
constexpr std::size_t kFewest = 3;   // positions on either side
constexpr double kGate = 6.0;        // sigmas: one in 70 million
// Part of a jump that must lie between two positions; otherwise the positions slide.
constexpr double kSharp = 0.5;
// Acceleration of a vehicle under way: a difference that it explains is not a jump.
constexpr double kAccelerationMps2 = 0.5;
constexpr std::size_t kNoiseSteps = 200;
// Positions over which position and velocity must have agreed: a minute at 5 Hz.
constexpr std::size_t kTrustedShifts = 300;
// A slower slide may be an error of the velocity, such as its lag in a turn.
constexpr double kSlideMps = 0.2;
// Variance of a median divided by that of a mean, for normal noise.
constexpr double kMedianVariance = 1.57;
constexpr double kSigmaPerMedian = 1.0 / 0.6745;
constexpr double kSigmaPerMedianStep = kSigmaPerMedian / 1.4142;

using Points = std::vector<Eigen::Vector2d>;

Eigen::Vector2d MedianOf(const Points& points) {
  std::vector<double> x, y;
  for (const Eigen::Vector2d& p : points) {
    x.push_back(p.x());
    y.push_back(p.y());
  }
  return {Median(std::move(x)), Median(std::move(y))};
}

Eigen::Vector2d MeanOf(const Points& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

// Appends the distances along both axes.
void AddDistances(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::vector<double>* out) {
  out->insert(out->end(), {std::abs(a.x() - b.x()), std::abs(a.y() - b.y())});
}

double SpreadOf(const Points& points) {
  const Eigen::Vector2d mean = MeanOf(points);
  double sum = 0.0;
  for (const Eigen::Vector2d& p : points) sum += (p - mean).squaredNorm();
  return sum;
}

// Complex product (a rotated by the angle of b and scaled by its length), and quotient.
Eigen::Vector2d Times(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {a.x() * b.x() - a.y() * b.y(), a.x() * b.y() + a.y() * b.x()};
}
Eigen::Vector2d Over(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return Times(a, {b.x(), -b.y()}) / b.squaredNorm();
}

// Appends velocities (forward, starboard) from pairs of positions `at`. ahead: the positions of a
// vehicle at 1 m/s.
void AddVelocities(const Points& at, const Points& ahead, Points* velocities) {
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t k = i + 1; k < at.size(); ++k)
      if (const Eigen::Vector2d way = ahead[k] - ahead[i]; way.squaredNorm() > 0.0)
        velocities->push_back(Over(at[k] - at[i], way));
}

}  // namespace

void JumpFinder::Add(const Position& position) {
  Entry entry{position, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), false};
  if (last_) {
    const Position& from = last_->position;
    if (!entry.position.heading_rad) entry.position.heading_rad = from.heading_rad;
    const double dt_s = ToSeconds(position.time - from.time);
    entry.by_velocity = position.v_mps && from.v_mps && dt_s <= kWindowS;
    const Eigen::Vector2d moved = position.given_m - from.given_m;
    entry.residual_m = last_->residual_m;
    if (entry.by_velocity) entry.residual_m += moved - 0.5 * dt_s * (*position.v_mps + *from.v_mps);
    const double begin_rad = from.heading_rad.value_or(0.0);
    const double turn_rad = WrapAngle(entry.position.heading_rad.value_or(0.0) - begin_rad);
    const double heading_rad = begin_rad + 0.5 * turn_rad;
    entry.ahead_m =
        last_->ahead_m + dt_s * Eigen::Vector2d(std::cos(heading_rad), std::sin(heading_rad));
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

std::vector<JumpFinder::Position> JumpFinder::Waiting() const {
  std::vector<Position> positions;
  for (const Entry& entry : waiting_) positions.push_back(entry.position);
  return positions;
}

void JumpFinder::DecideFirst(std::vector<Steady>* out) {
  const Entry first = waiting_.front();
  const Time t = first.position.time;
  if (!before_.empty() && ToSeconds(t - before_.back().position.time) > kWindowS) before_.clear();
  const Window window = Around();
  const double noise_m = Noise(window);
  waiting_.pop_front();
  if (IsSpike(window, noise_m)) {
    ++spikes_;
    return;
  }
  Steady steady{first.position, {}};
  Eigen::Vector2d correction_m = Eigen::Vector2d::Zero();   // no motion of the vehicle
  Eigen::Vector2d unexplained_m = Eigen::Vector2d::Zero();  // by the velocity
  if (first.by_velocity && !before_.empty())
    unexplained_m = first.residual_m - before_.back().residual_m;
  if (const auto jump_m = JumpIn(window, noise_m)) {
    steady.jumped = true;
    steady.jump_variance_m2 = window.variance * noise_m * noise_m;
    correction_m = *jump_m;
    slide_m_.setZero();
    before_.clear();
  } else if (Slides(noise_m, first)) {
    correction_m = unexplained_m;
    slide_m_ += unexplained_m;
  } else if (!slide_m_.isZero()) {
    steady.jumped = slide_m_.norm() > min_jump_m_;
    steady.jump_variance_m2 = 2.0 * noise_m * noise_m;
    slide_m_.setZero();
  }
  if (follow_velocity_ && first.by_velocity) {
    correction_m = unexplained_m;
    steady.jump_variance_m2 = 0.0;
  }
  jumps_m_ += correction_m;
  if (!before_.empty()) {
    std::vector<double> step_m;
    AddDistances(window.after_m.front(), window.before_m.back(), &step_m);
    steps_m_.insert(steps_m_.end(), step_m.begin(), step_m.end());
    while (steps_m_.size() > kNoiseSteps) steps_m_.pop_front();
  }
  steady.steady_m = first.position.given_m - jumps_m_;
  before_.push_back(first);
  while (before_.size() > kWindow || ToSeconds(t - before_.front().position.time) > kWindowS)
    before_.pop_front();
  out->push_back(std::move(steady));
}

JumpFinder::Window JumpFinder::Around() const {
  std::vector<const Entry*> before, after;
  for (const Entry& entry : before_) before.push_back(&entry);
  const Time t = waiting_.front().position.time;
  for (const Entry& entry : waiting_)
    if (after.size() < kWindow && ToSeconds(entry.position.time - t) <= kWindowS)
      after.push_back(&entry);
  const auto among = [](const std::vector<const Entry*>& entries, auto member) {
    Points points;
    for (const Entry* entry : entries) points.push_back(member(*entry));
    return points;
  };
  std::vector<const Entry*> all = before;
  all.insert(all.end(), after.begin(), after.end());
  const bool by_velocity =
      std::all_of(all.begin() + 1, all.end(), [](const Entry* e) { return e->by_velocity; });
  // Velocities have errors, too: the rest of the motion is an even slide.
  const auto place = [&](const Entry& e) {
    return by_velocity ? e.residual_m : e.position.given_m;
  };
  const auto way = [&](const Entry& e) -> Eigen::Vector2d {
    if (by_velocity) return {ToSeconds(e.position.time - t), 0.0};
    return e.ahead_m - waiting_.front().ahead_m;
  };
  const Points way_before = among(before, way), way_after = among(after, way);
  Window window{among(before, place), among(after, place), min_jump_m_, 0.0};
  Points velocities;
  AddVelocities(window.before_m, way_before, &velocities);
  AddVelocities(window.after_m, way_after, &velocities);
  if (velocities.empty()) return window;
  const Eigen::Vector2d v_mps = MedianOf(velocities);
  for (std::size_t i = 0; i < before.size(); ++i) window.before_m[i] -= Times(v_mps, way_before[i]);
  for (std::size_t i = 0; i < after.size(); ++i) window.after_m[i] -= Times(v_mps, way_after[i]);
  if (before.empty()) return window;
  // Variance of the difference of the medians, and of the velocity over the distance between both
  // sides.
  window.variance =
      kMedianVariance *
      (1.0 / static_cast<double>(before.size()) + 1.0 / static_cast<double>(after.size()) +
       (MeanOf(way_after) - MeanOf(way_before)).squaredNorm() /
           std::max(SpreadOf(way_before) + SpreadOf(way_after), 1e-9));
  if (by_velocity) return window;
  const double dt_s = ToSeconds(t - before.back()->position.time);
  window.min_jump_m = std::max(min_jump_m_, kAccelerationMps2 * dt_s * dt_s);
  return window;
}

std::optional<Eigen::Vector2d> JumpFinder::JumpIn(const Window& window, double noise_m) const {
  const auto& [before, after, min_jump_m, variance] = window;
  if (before.size() < kFewest || after.size() < kFewest) return std::nullopt;
  const Eigen::Vector2d jump = MedianOf(after) - MedianOf(before);
  if (jump.norm() <= std::max(min_jump_m, kGate * noise_m * std::sqrt(variance)))
    return std::nullopt;
  // A jump must be the sharpest step in the window, not one of many similar ones.
  const Eigen::Vector2d direction = jump.normalized();
  const double here_m = direction.dot(after.front() - before.back());
  std::vector<double> others_m;
  for (std::size_t i = 1; i < before.size(); ++i)
    others_m.push_back(direction.dot(before[i] - before[i - 1]));
  for (std::size_t i = 1; i < after.size(); ++i) {
    others_m.push_back(direction.dot(after[i] - after[i - 1]));
    if (others_m.back() > here_m) return std::nullopt;
  }
  if (here_m - Median(std::move(others_m)) < kSharp * jump.norm()) return std::nullopt;
  return jump;
}

// True if position and velocity disagree around `first`, the position to be decided, and have
// agreed before.
bool JumpFinder::Slides(double noise_m, const Entry& first) {
  Points before, after{first.residual_m};
  for (const Entry& entry : before_) before.push_back(entry.residual_m);
  bool by_velocity = first.by_velocity;
  const Time t = first.position.time;
  Time last = t;
  for (const Entry& entry : waiting_) {
    if (after.size() >= kWindow || ToSeconds(entry.position.time - t) > kWindowS) break;
    by_velocity = by_velocity && entry.by_velocity;
    after.push_back(entry.residual_m);
    last = entry.position.time;
  }
  if (!by_velocity || before.size() < kFewest || after.size() < kFewest) return false;
  const double shift_m = (MedianOf(after) - MedianOf(before)).norm();
  const bool agreed =
      shifts_m_.size() >= kWindow &&
      Median(std::vector<double>(shifts_m_.begin(), shifts_m_.end())) < 0.5 * min_jump_m_;
  shifts_m_.push_back(shift_m);
  if (shifts_m_.size() > kTrustedShifts) shifts_m_.pop_front();
  const double between_s = 0.5 * ToSeconds(last - before_.front().position.time);
  const double sigma_m =
      noise_m * std::sqrt(kMedianVariance * (1.0 / static_cast<double>(before.size()) +
                                             1.0 / static_cast<double>(after.size())));
  return agreed && shift_m > std::max({min_jump_m_, kSlideMps * between_s, kGate * sigma_m});
}

// True if the positions after agree with those before, and this position differs from its
// neighbours.
bool JumpFinder::IsSpike(const Window& window, double noise_m) const {
  const auto& [before, after, min_jump_m, variance] = window;
  if (before.size() < kFewest || after.size() < kFewest + 1) return false;
  const Eigen::Vector2d earlier = MedianOf(before);
  const Eigen::Vector2d later = MedianOf(Points(after.begin() + 1, after.end()));
  const Eigen::Vector2d last = MedianOf(Points(before.end() - kFewest, before.end()));
  const Eigen::Vector2d next = MedianOf(Points(after.begin() + 1, after.begin() + 1 + kFewest));
  const double threshold_m = std::max(min_jump_m, kGate * noise_m);
  return (later - earlier).norm() < threshold_m && (after.front() - last).norm() > threshold_m &&
         (after.front() - next).norm() > threshold_m;
}

// Noise of a position, per axis, 1 sigma: from the steps of earlier positions and of the window. It
// is larger if the window's positions scatter more, because they do not move as assumed.
double JumpFinder::Noise(const Window& window) const {
  std::vector<double> steps(steps_m_.begin(), steps_m_.end());
  for (std::size_t i = 1; i < window.after_m.size() && steps.size() < 2 * kWindow; ++i)
    AddDistances(window.after_m[i], window.after_m[i - 1], &steps);
  std::vector<double> off_m;
  for (const Points* const side : {&window.before_m, &window.after_m}) {
    if (side->empty()) continue;
    const Eigen::Vector2d median = MedianOf(*side);
    for (const Eigen::Vector2d& p : *side) AddDistances(p, median, &off_m);
  }
  const double by_steps_m = steps.empty() ? 0.0 : kSigmaPerMedianStep * Median(std::move(steps));
  // Corrects for the fitted parameters: two positions and a velocity.
  const double n = 0.5 * static_cast<double>(off_m.size());
  const double fitted = std::sqrt(n / std::max(n - 3.0, 1.0));
  return fitted * std::max(by_steps_m, kSigmaPerMedian * Median(std::move(off_m)));
}

}  // namespace seastitch
