#pragma once

#include <variant>

#include "common/core/heartbeat.hpp"
#include "common/core/message_stamp.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {

// What a mapper takes: a measurement of a sensor, or the sign of life of a process.
using Sample = std::variant<ImuSample,
                            DvlSample,
                            DepthSample,
                            NavigationSample,
                            PositionFix,
                            MbesPing,
                            SoundingPing,
                            SoundVelocityProfile,
                            Heartbeat>;

// A sample, and when its message came.
struct Received {
  Sample sample;
  MessageStamp stamp;
};

// Names of the kinds of samples, in the names of counters.
constexpr const char* NameOf(const ImuSample&) { return "imu"; }
constexpr const char* NameOf(const DvlSample&) { return "dvl"; }
constexpr const char* NameOf(const DepthSample&) { return "depth"; }
constexpr const char* NameOf(const NavigationSample&) { return "ins"; }
constexpr const char* NameOf(const PositionFix&) { return "position_fix"; }
constexpr const char* NameOf(const MbesPing&) { return "mbes_ping"; }
constexpr const char* NameOf(const SoundingPing&) { return "mbes_soundings"; }
constexpr const char* NameOf(const SoundVelocityProfile&) { return "svp"; }
constexpr const char* NameOf(const Heartbeat&) { return "health"; }

// A visitor of a variant, from one function for each kind.
template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

}  // namespace seastitch
