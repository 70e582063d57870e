#pragma once

#include <cstdint>

namespace seastitch {

// The figures of HEALTH that another process of ours reads. All other counters are for people.
enum class HealthValue : std::uint8_t {
  kSocketDrops,  // datagrams and frames that the kernel dropped, of all sockets of the process
  // Of the mapper: messages that did not arrive, and samples that came too late or with a time too
  // far ahead: left out, or taken out of their order.
  kInputMissed,
  // Of a driver, with the name of the device before it, such as imu_clock_settled: see ClockModel.
  kClockSettled,  // 0 or 1
  kClockOffset,   // [us]
  kClockDrift,    // [ppb]
  // Of the logger.
  kEventsDropped,  // messages for which it had no room
  kDiveStart,      // start of the dive that it records, microseconds since the Unix epoch
  kDiskFree,       // free space [MB] where it records
};

constexpr const char* NameOf(HealthValue value) {
  switch (value) {
    case HealthValue::kSocketDrops: return "socket_drops";
    case HealthValue::kInputMissed: return "input_missed";
    case HealthValue::kClockSettled: return "clock_settled";
    case HealthValue::kClockOffset: return "clock_offset_us";
    case HealthValue::kClockDrift: return "clock_drift_ppb";
    case HealthValue::kEventsDropped: return "events_dropped";
    case HealthValue::kDiveStart: return "dive_start_utime";
    case HealthValue::kDiskFree: return "disk_free_mb";
  }
  return "";
}

}  // namespace seastitch
