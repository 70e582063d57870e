#pragma once

#include <cstdint>
#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Whose clock a measurement's utime comes from.
enum class DeviceClock : std::uint8_t {
  kDevice,   // the device stamps in UTC (its clock is disciplined)
  kReceive,  // the kernel's receive stamp less latency_s
};

struct ClockParams {
  DeviceClock clock = DeviceClock::kDevice;
  double latency_s = 0.0;  // from measurement to our receive stamp; used with kReceive

  std::string Validate() const {
    return latency_s >= 0.0 && latency_s < 10.0 ? "" : "latency_s must be 0 to 10";
  }
  Time FromReceive(Time recv) const { return recv - FromSeconds(latency_s); }
};

}  // namespace seastitch
