#include "drivers/device_clock.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/health/health_values.hpp"

namespace seastitch {
namespace {

// A clock's drift changes little within the window. Of most devices, a slot of a second contains a
// message with little delay.
constexpr double kWindowS = 60.0;
constexpr double kSlotS = 1.0;
constexpr double kDriftSpanS = 20.0;  // over a shorter time a late message looks like drift
constexpr double kMaxDrift = 500e-6;  // a poor crystal, or the computer's clock being slewed
// A delay cannot be negative: a message that is earlier than the line by more than this shows a
// step of a clock.
constexpr double kStepS = 0.050;
// Messages later than the line may come from a stall of the transport. If all of them are late for
// so long, and so many, a clock has stepped.
constexpr Duration kStallLimit = std::chrono::seconds(2);
constexpr int kStallMessages = 10;
// Messages later than this [s] are not stamped while it is undecided whether a clock stepped: their
// stamps could be wrong by as much. No transport is so late often.
constexpr double kDoubtS = 0.5;

std::int64_t Rounded(double seconds) { return std::llround(seconds * 1e6); }

}  // namespace

Duration WrappingCounter::Unwrap(std::uint32_t count, Time recv) {
  const double passed_s = last_recv_ ? ToSeconds(recv - *last_recv_) : 0.0;
  const std::int64_t expected = last_count_ + std::llround(passed_s / tick_s_);
  const auto ahead = static_cast<std::int32_t>(count - static_cast<std::uint32_t>(expected));
  last_count_ = last_recv_ ? expected + ahead : count;
  last_recv_ = recv;
  return Duration(Rounded(static_cast<double>(last_count_) * tick_s_));
}

void LowerEnvelope::Add(double x, double y) {
  const double slot = std::floor(x / kSlotS);
  const double newest = points_.empty() ? slot - 1.0 : std::floor(points_.back().x / kSlotS);
  if (slot < newest) return;
  const Point point{x, y};
  if (slot > newest) {
    points_.push_back(point);
    while (points_.front().x < x - kWindowS) points_.pop_front();
  } else if (AboveSlope(point) < AboveSlope(points_.back())) {
    points_.back() = point;
  } else {
    return;
  }
  Fit();
}

void LowerEnvelope::Fit() {
  if (span() >= kDriftSpanS) slope_ = std::clamp(HullSlope(), -kMaxDrift, kMaxDrift);
  intercept_ = AboveSlope(points_.front());
  for (const Point& p : points_) intercept_ = std::min(intercept_, AboveSlope(p));
}

double LowerEnvelope::HullSlope() const {
  std::vector<Point> hull;
  double sum_x = 0.0;
  for (const Point& p : points_) {
    // true if b lies above the line from a to p
    const auto above = [&p](const Point& a, const Point& b) {
      return (b.y - a.y) * (p.x - a.x) >= (p.y - a.y) * (b.x - a.x);
    };
    while (hull.size() >= 2 && above(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(p);
    sum_x += p.x;
  }
  const double mean_x = sum_x / static_cast<double>(points_.size());
  std::size_t end = 1;
  while (hull[end].x < mean_x) ++end;
  return (hull[end].y - hull[end - 1].y) / (hull[end].x - hull[end - 1].x);
}

double LowerEnvelope::spread() const {
  if (points_.empty()) return 0.0;
  double sum = 0.0;
  for (const Point& p : points_) sum += p.y - At(p.x);
  return sum / static_cast<double>(points_.size());
}

double ClockModel::ClockSegment::Y(Duration device, Time recv) const {
  return ToSeconds(recv.time_since_epoch() - device - lag_zero);
}

void ClockModel::ClockSegment::Add(Duration device, Time recv) {
  lag.Add(X(device), Y(device, recv));
  ++messages;
}

ClockModel::ClockSegment ClockModel::Begin(Duration device, Time recv, double slope) {
  ClockSegment segment{device, recv.time_since_epoch() - device, recv, 0, LowerEnvelope(slope)};
  segment.Add(device, recv);
  return segment;
}

std::optional<Time> ClockModel::Add(Duration device, Time recv) {
  if (!now_) now_ = Begin(device, recv, 0.0);
  const auto late_s = [&] { return now_->Y(device, recv) - now_->lag.At(now_->X(device)); };
  if (late_s() < -kStepS) {
    Step(Begin(device, recv, now_->lag.slope()));
  } else if (late_s() > kStepS) {
    Doubt(device, recv);
    if (late_s() > kDoubtS) return std::nullopt;
  } else {
    next_.reset();
    now_->Add(device, recv);
  }
  const double lag_s = now_->lag.At(now_->X(device));
  offset_s_ = ToSeconds(now_->lag_zero) + lag_s - least_delay_s_;
  return Time(device + now_->lag_zero + FromSeconds(lag_s - least_delay_s_));
}

void ClockModel::Doubt(Duration device, Time recv) {
  if (next_)
    next_->Add(device, recv);
  else
    next_ = Begin(device, recv, now_->lag.slope());
  if (recv - next_->began >= kStallLimit && next_->messages >= kStallMessages) Step(*next_);
}

void ClockModel::Step(const ClockSegment& next) {
  // Steps before the model is settled are not counted: a clock that steps all the time does not run
  // at the computer's rate at all.
  if (settled()) ++steps_;
  now_ = next;
  next_.reset();
}

bool ClockModel::settled() const { return now_ && now_->lag.span() >= kDriftSpanS; }

std::optional<Time> Stamper::Stamp(Time device, Time recv, Duration measuring) {
  if (params_.clock == DeviceClock::kReceive) return params_.FromReceive(recv);
  const std::optional<Time> modelled = model_.Add(device.time_since_epoch(), recv - measuring);
  return params_.clock == DeviceClock::kModel ? modelled : device;
}

Counters Stamper::Figures(const std::string& prefix) const {
  if (params_.clock == DeviceClock::kReceive) return {};
  return {{prefix + "_clock_steps", model_.steps()},
          {prefix + "_" + NameOf(HealthValue::kClockSettled), model_.settled() ? 1 : 0},
          {prefix + "_" + NameOf(HealthValue::kClockOffset), Rounded(model_.offset_s())},
          {prefix + "_" + NameOf(HealthValue::kClockDrift), std::llround(model_.drift_ppm() * 1e3)},
          {prefix + "_clock_error_us", Rounded(model_.error_s())}};
}

}  // namespace seastitch
