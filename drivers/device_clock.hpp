#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/core/health/counters.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// The clock of `utime`, the time of a measurement in UTC.
enum class DeviceClock : std::uint8_t {
  kDevice,   // the device's own, which must be UTC (disciplined by GNSS, PPS or NTP)
  kModel,    // the device's, mapped to the computer's clock by a ClockModel
  kReceive,  // the kernel's receive stamp minus latency_s
};

struct ClockParams {
  DeviceClock clock = DeviceClock::kDevice;
  // From the measurement to the receive stamp: with kReceive the constant delay, with kModel the
  // minimum delay. With kDevice only for messages without a time.
  double latency_s = 0.0;
  Time FromReceive(Time recv) const { return recv - FromSeconds(latency_s); }
};

// Unwraps a 32-bit counter of ticks. The number of wraps is the one that agrees best with the time
// elapsed on the computer's clock.
class WrappingCounter {
 public:
  explicit WrappingCounter(double tick_s) : tick_s_(tick_s) {}
  // Time since the counter was 0, for the first call without wraps.
  Duration Unwrap(std::uint32_t count, Time recv);

 private:
  double tick_s_;
  std::int64_t last_count_ = 0;
  std::optional<Time> last_recv_;
};

// The straight line below a set of points with the least sum of vertical distances: the edge of
// their lower convex hull that spans the mean x (Moon, Skelly, Towsley: Estimation and removal of
// clock skew from network delay measurements, 1999). It keeps the points of the last 60 s, the
// lowest of each second. With x the device's time and y = receive stamp minus device time, no point
// is below the true line, because transport only adds delay.
class LowerEnvelope {
 public:
  // slope: used until the points span 20 s.
  explicit LowerEnvelope(double slope = 0.0) : slope_(slope) {}
  // x, y: seconds. A point of an earlier second than the newest is ignored.
  void Add(double x, double y);
  double At(double x) const { return intercept_ + slope_ * x; }
  double slope() const { return slope_; }
  double span() const { return points_.empty() ? 0.0 : points_.back().x - points_.front().x; }
  // Mean height of the kept points above the line [s].
  double spread() const;

 private:
  struct Point {
    double x;
    double y;
  };
  void Fit();
  double HullSlope() const;
  double AboveSlope(const Point& p) const { return p.y - slope_ * p.x; }

  std::deque<Point> points_;  // one per second
  double slope_;
  double intercept_ = 0.0;
};

// Offset and drift of the computer's clock with respect to a device's clock, estimated from the
// receive stamps of its messages. It reads no clock: a replay of a log gives the same values.
class ClockModel {
 public:
  // least_delay_s: minimum delay from the device's stamp to the receive stamp, which is not
  // observable.
  explicit ClockModel(double least_delay_s) : least_delay_s_(least_delay_s) {}

  // Adds a message. device: its stamp by the device's clock, from an arbitrary origin. Returns that
  // instant on the computer's clock. Early and late are with respect to the model's prediction. A
  // message more than 50 ms early is a clock step. If all messages for 2 s (10 at least) are more
  // than 50 ms late, a clock has stepped; until then the transport may be stalled, and a message
  // more than 0.5 s late gets no stamp.
  std::optional<Time> Add(Duration device, Time recv);

  // Steps of either clock, counted while settled().
  std::int64_t steps() const { return steps_; }
  // True when the drift is estimated: from 20 s after the start or a step.
  bool settled() const;
  double offset_s() const { return offset_s_; }  // computer's minus device's, last
  // Rate of offset_s(); positive: the computer's clock is faster.
  double drift_ppm() const { return now_ ? 1e6 * now_->lag.slope() : 0.0; }
  // Mean of the least delay of each second, above the minimum delay.
  double error_s() const { return now_ ? now_->lag.spread() : 0.0; }

 private:
  // The estimate between two clock steps.
  struct ClockSegment {
    Duration device_zero;
    Duration lag_zero;
    Time began;
    int messages = 0;
    LowerEnvelope lag;  // receive stamp minus device time

    double X(Duration device) const { return ToSeconds(device - device_zero); }
    double Y(Duration device, Time recv) const;
    void Add(Duration device, Time recv);
  };
  static ClockSegment Begin(Duration device, Time recv, double slope);
  void Doubt(Duration device, Time recv);
  void Step(const ClockSegment& next);

  double least_delay_s_;
  std::optional<ClockSegment> now_;
  std::optional<ClockSegment> next_;  // messages that came too late for now_: a step, or a stall
  double offset_s_ = 0.0;
  std::int64_t steps_ = 0;
};

// Computes the utime of measurements by the clock that the configuration names.
class Stamper {
 public:
  explicit Stamper(const ClockParams& params) : params_(params), model_(params.latency_s) {}

  // device: its own time, UTC with kDevice, else from an arbitrary origin. measuring: minimum time
  // from it to the transmission of the message, such as the travel time of a ping's last echo; it
  // is added to the minimum delay. With kModel it returns nothing where
  // ClockModel::Add() does.
  std::optional<Time> Stamp(Time device, Time recv, Duration measuring = {});

  // Counters of the clock for HEALTH: PREFIX_clock_steps, _clock_settled (1 or 0),
  // _clock_offset_us, _clock_drift_ppb, _clock_error_us, as in ClockModel. Empty with kReceive.
  Counters Figures(const std::string& prefix) const;

 private:
  ClockParams params_;
  ClockModel model_;
};

}  // namespace seastitch
