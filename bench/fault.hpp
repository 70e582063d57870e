#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace seastitch::bench {

enum class FaultKind : std::uint8_t {
  kDvlDropout,  // the DVL has no bottom lock
  kPacketLoss,  // packets between device and driver are lost
};

// What sends something. Position fixes come from GPS or USBL, straight to LCM: no bytes, no faults
// of transport, and not in a live simulation.
enum class Device : std::uint8_t { kImu, kDvl, kMbes, kFix };

// Something that goes wrong during a part of the survey, beyond what the sensors' errors are.
struct Fault {
  FaultKind kind = FaultKind::kDvlDropout;
  double from_s = 0.0;  // since the start of the survey
  double to_s = std::numeric_limits<double>::infinity();
  // Of kPacketLoss.
  Device device = Device::kMbes;
  double rate = 0.01;
};

}  // namespace seastitch::bench
