#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "codecs/nmea0183.hpp"
#include "common/core/bytes.hpp"
#include "common/core/counters.hpp"
#include "common/core/sensors.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/device_clock.hpp"

namespace seastitch {

using NavOutput = std::variant<NavigationSample, PositionFix, DepthSample>;

// Interface of the data formats of an instrument. Bytes come in pieces of any size.
class NavCodec {
 public:
  virtual ~NavCodec() = default;

  virtual std::vector<NavOutput> Add(Bytes bytes, Time recv) = 0;
  // Number of messages of the instrument so far, with or without a measurement.
  virtual std::int64_t heard() const = 0;
  // What is received instead of the wanted messages, for people: "GLL, GSV"; empty: nothing.
  virtual std::string hears_instead() const { return ""; }
  // Of an instrument on CAN: the frames that it wants. Its bytes are cannelloni packets.
  virtual std::vector<CanFilter> can_filters() const { return {}; }

  virtual Counters counters() const = 0;
  // PREFIX_clock_..., see Stamper.
  virtual Counters clock_figures(const std::string& prefix) const = 0;
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

// Types and number of received sentences that are not read.
class OtherSentences {
 public:
  void Add(std::string_view type);
  std::string names() const;
  std::int64_t count() const { return count_; }

 private:
  std::set<std::string, std::less<>> types_;
  std::int64_t count_ = 0;
};

}  // namespace seastitch
