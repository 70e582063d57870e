#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"

namespace seastitch {

// A signal's value as a unit's count.
inline std::uint32_t CountOf(double value) {
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

// The clock of a unit on CAN: 32 bits of microseconds since power-up, and now and then the UTC of
// an instant that it counted.
class UnitClock {
 public:
  // Fields of the signal map, from that which the constructor is told on.
  enum Field : std::size_t {
    kTimeUs,  // count at the instant that the calendar below names; its frame comes first. Not
              // mapped: the calendar is that of the epoch in which it comes
    kTimeOfWeekMs,
    kYear,
    kMonth,
    kDay,
    kHour,
    kMinute,
    kSecond,
    kMicrosecond,
    kNumFields,
  };
  // A count, and when the frame came that stated it.
  struct Reading {
    std::uint32_t device_us;
    Time recv;
  };

  // max_burst_s: between the first and the last frame of one UTC.
  UnitClock(const SignalMap& signals,
            std::size_t first_field,
            const ClockParams& params,
            double max_burst_s);

  // A count came: the unit may have been restarted.
  void See(std::uint32_t device_us);
  bool Wants(const FieldValues& values) const { return (values.present & fields_).any(); }
  // Values of a frame that it wants. epoch: that is open, if any.
  void Add(const FieldValues& values, Time recv, const std::optional<Reading>& epoch);
  // The instant of a count: by the last UTC, by a model of the unit's clock or by the receive
  // stamp. Nothing where there was no UTC yet, or see ClockModel.
  std::optional<Time> Stamp(const Reading& reading);

  // utc_malformed, utc_stepped, device_restarted.
  const Counters& counters() const { return counters_; }
  Counters Figures(const std::string& prefix) const { return stamper_.Figures(prefix); }

 private:
  struct Anchor {
    std::uint32_t device_us = 0;
    Time utc;
  };
  std::optional<Time> DeviceTime(const Reading& reading);

  ClockParams params_;
  std::size_t first_;
  double max_burst_s_;
  bool has_count_;  // kTimeUs is mapped
  std::bitset<kMaxFields> fields_;
  std::bitset<kMaxFields> needed_;
  FieldValues utc_;
  Time utc_recv_;
  std::optional<std::uint32_t> last_device_us_;
  std::optional<Anchor> anchor_;
  WrappingCounter counter_{1e-6};
  Stamper stamper_;
  Counters counters_;
};

}  // namespace seastitch
