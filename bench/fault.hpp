#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace seastitch::bench {

enum class FaultKind : std::uint8_t {
  kDvlDropout,  // the DVL has no bottom lock
  kPacketLoss,  // packets between device and driver are lost
};

// Sender of an event. Position fixes (GPS, USBL) are sent as LCM messages, not as bytes: they have
// no faults of transport.
enum class Device : std::uint8_t { kImu, kDvl, kMbes, kFix };

// A fault during a part of the survey, in addition to the sensors' errors.
struct Fault {
  FaultKind kind = FaultKind::kDvlDropout;
  double from_s = 0.0;  // since the start of the survey
  double to_s = std::numeric_limits<double>::infinity();
  // Used with kPacketLoss.
  Device device = Device::kMbes;
  double rate = 0.01;  // probability that a packet is lost, 0 to 1
};

}  // namespace seastitch::bench
