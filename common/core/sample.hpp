#pragma once

#include <cstdint>
#include <string>
#include <type_traits>
#include <variant>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Receive time and sequence number that a message has in addition to the measurement.
struct MessageStamp {
  Time recv;  // receive time by the computer's clock
  std::int64_t seq = 0;
};

// Sign of life of a process (HEALTH), with the two clocks of its computer at the same instant.
struct Heartbeat {
  std::string process;    // such as mapper
  Time time;              // by the system's clock, which may be set
  double uptime_s = 0.0;  // since the process started, by the monotonic clock
};

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

// The kinds that navigation uses. After each of them the mapper may look for further closures.
template <class T>
constexpr bool kIsOfNavigation =
    std::is_same_v<T, ImuSample> || std::is_same_v<T, DvlSample> ||
    std::is_same_v<T, DepthSample> || std::is_same_v<T, NavigationSample> ||
    std::is_same_v<T, PositionFix>;

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
