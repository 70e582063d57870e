#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/device_clock.hpp"

namespace seastitch {

using NavOutput = std::variant<NavigationSample, PositionFix, DepthSample>;

// Base class of the codecs of instruments. Bytes come in pieces of any size.
class NavCodec {
 public:
  virtual ~NavCodec() = default;

  std::vector<NavOutput> Add(Bytes bytes, Time recv) {
    Read(bytes, recv);
    return std::exchange(out_, {});
  }
  // Number of messages that show that the instrument works, with or without a measurement.
  std::int64_t messages() const { return messages_; }
  // Messages received in place of those that are read, for people: "GLL, GSV". Empty if there are
  // none.
  virtual std::string unused_messages() const { return ""; }
  // CAN frames that an instrument on CAN needs. Its bytes are cannelloni packets.
  virtual std::vector<CanFilter> can_filters() const { return {}; }

  virtual Counters counters() const { return counters_; }
  // PREFIX_clock_..., see Stamper.
  virtual Counters clock_figures(const std::string& prefix) const = 0;

 protected:
  virtual void Read(Bytes bytes, Time recv) = 0;
  void CountMessage() { ++messages_; }
  void Count(const std::string& what, std::int64_t times = 1) { counters_[what] += times; }
  template <class Output>
  void Emit(Output output) {
    out_.emplace_back(std::move(output));
  }

 private:
  std::int64_t messages_ = 0;
  Counters counters_;
  std::vector<NavOutput> out_;
};

// Times of messages that state only the time of day, and of a date in some of them.
class DayClock {
 public:
  explicit DayClock(const ClockParams& params) : params_(params), stamper_(params) {}

  // device: date and time in UTC that the instrument stated; recv: receive stamp of that message.
  void SetDate(Time device, Time recv) { known_ = {device, recv}; }
  // The date is the one that brings the time of day nearest to the last stated date and time, else
  // to the receive stamp. A message without a time has its receive stamp minus latency_s. Returns
  // nothing where Stamper does.
  std::optional<Time> Stamp(std::optional<Duration> time_of_day, Time recv);
  Counters Figures(const std::string& prefix) const { return stamper_.Figures(prefix); }

 private:
  struct Known {
    Time device;
    Time recv;
  };
  ClockParams params_;
  Stamper stamper_;
  std::optional<Known> known_;
};

}  // namespace seastitch
