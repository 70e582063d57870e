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

// How one instrument speaks. Bytes come in pieces of any size.
class NavCodec {
 public:
  virtual ~NavCodec() = default;

  virtual std::vector<NavOutput> Add(Bytes bytes, Time recv) = 0;
  // Messages that show the instrument to be alive, with a measurement or without.
  virtual std::int64_t heard() const = 0;
  // What comes in place of what is wanted, for people: "GLL, GSV"; empty: nothing does.
  virtual std::string hears_instead() const { return ""; }
  // Of an instrument on CAN: the frames that it wants. Its bytes are cannelloni packets.
  virtual std::vector<CanFilter> can_filters() const { return {}; }

  virtual Counters counters() const = 0;
  // PREFIX_clock_..., see Stamper.
  virtual Counters clock_figures(const std::string& prefix) const = 0;
};

// Instants of messages that state the time of day at most, and the date now and then.
class DayClock {
 public:
  explicit DayClock(const ClockParams& params) : params_(params), stamper_(params) {}

  // The instrument's UTC when these bytes came.
  void SetDate(Time device, Time recv) { known_ = {device, recv}; }
  // The day is that which brings it nearest to the date last stated, else to the receive stamp. A
  // message without a time is as old as its latency. Nothing: see ClockModel.
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

// Sentences of types that nobody reads: which, and how many.
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
