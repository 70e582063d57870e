#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/core/counters.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Whose clock a measurement's utime comes from.
enum class DeviceClock : std::uint8_t {
  kDevice,   // the device stamps in UTC (its clock is disciplined)
  kModel,    // the device's clock, mapped to ours by a ClockModel
  kReceive,  // the kernel's receive stamp less latency_s
};

struct ClockParams {
  DeviceClock clock = DeviceClock::kDevice;
  // From measurement to our receive stamp. With kReceive: always; with kModel: at the least.
  double latency_s = 0.0;
  Time FromReceive(Time recv) const { return recv - FromSeconds(latency_s); }
};

// A 32-bit counter to a time that does not wrap: the one nearest to what has passed on our clock.
class WrappingCounter {
 public:
  explicit WrappingCounter(double tick_s) : tick_s_(tick_s) {}
  Duration Unwrap(std::uint32_t count, Time recv);

 private:
  double tick_s_;
  std::int64_t last_count_ = 0;
  std::optional<Time> last_recv_;
};

// The straight line that lies below every point and nearest to them all: the edge of their lower
// convex hull over their mean (Moon, Skelly and Towsley 1999). Of the points of a second the lowest
// is kept, for a minute: where x is a device's time and y how far our receive stamps lie behind it,
// points are never below the true line, for transport only ever delays.
class LowerEnvelope {
 public:
  // slope: until the points span enough to tell it.
  explicit LowerEnvelope(double slope = 0.0) : slope_(slope) {}
  // x: seconds, rising; a point of an older second is not used.
  void Add(double x, double y);
  double At(double x) const { return intercept_ + slope_ * x; }
  double slope() const { return slope_; }
  double span() const { return points_.empty() ? 0.0 : points_.back().x - points_.front().x; }
  // Mean height of the kept points above the line: how well they agree on where it lies.
  double spread() const;

 private:
  struct Point {
    double x;
    double y;
  };
  void Fit();
  double HullSlope() const;
  double AboveSlope(const Point& p) const { return p.y - slope_ * p.x; }

  std::deque<Point> points_;  // one a second
  double slope_;
  double intercept_ = 0.0;
};

// How a device's clock runs against ours, learned from when its messages came in. Knows only the
// stamps it is given: a log played again gives the same.
class ClockModel {
 public:
  // least_delay_s: from the device's stamp to our receive stamp; cannot be learned.
  explicit ClockModel(double least_delay_s) : least_delay_s_(least_delay_s) {}

  // A message that the device stamped `device` (any zero) was received. Gives that instant on our
  // clock; nothing while it is open whether a clock stepped or the transport stalls.
  std::optional<Time> Add(Duration device, Time recv);

  // Of either clock, since it was settled.
  std::int64_t steps() const { return steps_; }
  // False at first and after a step, until the drift can be told: 20 s.
  bool settled() const;
  double offset_s() const { return offset_s_; }  // our clock less the device's, now
  double drift_ppm() const { return now_ ? 1e6 * now_->lag.slope() : 0.0; }
  double error_s() const { return now_ ? now_->lag.spread() : 0.0; }  // beyond the least delay

 private:
  // What the messages say as long as no clock steps.
  struct Era {
    Duration device_zero;
    Duration lag_zero;
    Time began;
    int messages = 0;
    LowerEnvelope lag;  // of our receive stamps behind the device's time

    double X(Duration device) const { return ToSeconds(device - device_zero); }
    double Y(Duration device, Time recv) const;
    void Add(Duration device, Time recv);
  };
  static Era Begin(Duration device, Time recv, double slope);
  void Doubt(Duration device, Time recv);
  void Step(const Era& next);

  double least_delay_s_;
  std::optional<Era> now_;
  std::optional<Era> next_;  // messages that came too late for now_: a step, or a stall
  double offset_s_ = 0.0;
  std::int64_t steps_ = 0;
};

// The utime of what a device measured, by the clock that the configuration names.
class Stamper {
 public:
  explicit Stamper(const ClockParams& params) : params_(params), model_(params.latency_s) {}

  // device: its own time, in UTC with kDevice, else with any zero. `measuring`: what must have
  // passed from it until anything could be sent. Nothing: see ClockModel.
  std::optional<Time> Stamp(Time device, Time recv, Duration measuring = {});

  // How good the clock is, for HEALTH: PREFIX_clock_steps, _clock_settled (1 or 0),
  // _clock_offset_us (ours less the device's), _clock_drift_ppb, _clock_error_us.
  Counters Figures(const std::string& prefix) const;

 private:
  ClockParams params_;
  ClockModel model_;
};

}  // namespace seastitch
