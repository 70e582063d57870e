#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"

namespace seastitch {

// A signal's value as the unit's 32-bit count.
inline std::uint32_t CountOf(double value) {
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

// Converts the clock of a unit on CAN to UTC. The unit counts microseconds since power-up (32 bits)
// and sometimes sends the UTC of one count.
class UnitClock {
 public:
  // Fields of the signal map, counted from the constructor's first_field.
  enum Field : std::size_t {
    kTimeUs,  // Count of the instant that the calendar fields state; it is sent before them. If it
              // is not mapped, the calendar is that of the epoch in which it is received.
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
  // A count, and the receive stamp of its frame.
  struct Reading {
    std::uint32_t device_us;
    Time recv;
  };

  // max_burst_s: longest time between the first and the last frame of one UTC.
  UnitClock(const SignalMap& signals,
            std::size_t first_field,
            const ClockParams& params,
            double max_burst_s);

  // Takes a count that was received. A large step of the count shows that the unit was restarted.
  void AddCount(std::uint32_t device_us);
  bool Uses(const FieldValues& values) const { return (values.present & fields_).any(); }
  // Takes the values of a frame for which Uses() is true. epoch: the open epoch, if any.
  void Add(const FieldValues& values, Time recv, const std::optional<Reading>& epoch);
  // UTC of a count: from the last UTC, from a model of the unit's clock, or from the receive stamp.
  // Nothing before the first UTC; of a model see ClockModel.
  std::optional<Time> Stamp(const Reading& reading);

  // Names: utc_malformed, utc_stepped, device_restarted.
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
  bool has_count_;  // true if kTimeUs is mapped
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
