#pragma once

#include <cstdint>
#include <string>

#include "bench/log.hpp"
#include "bench/simulator.hpp"

namespace seastitch::bench {

// Addresses of the drivers, "HOST:PORT" each. CAN frames are sent as cannelloni packets, one per
// burst.
struct LiveTargets {
  std::string imu;
  std::string dvl;
  std::string mbes;
  std::string lcm_url{};  // bus for position fixes, which have no driver; empty: Bus's default
};

struct LiveResult {
  std::int64_t packets = 0;
  std::int64_t bytes = 0;
  std::int64_t refused = 0;  // packets without a receiver, or refused by the kernel
  double wall_s = 0.0;
  double max_lag_s = 0.0;  // largest delay of a packet behind its time
};

// Start of a live survey at a later time, such as after a power cut of the vehicle.
struct LiveFrom {
  double survey_s = 0.0;  // events before this second are not sent, except for the sonar's profile
  bool now = false;       // nor events that are in the past by the system clock
};

// Sends the survey's bytes over UDP and its position fixes on the bus, paced by the machine's
// monotonic clock at `speed` times real time. Throws std::runtime_error "HOST:PORT: reason",
// std::invalid_argument unless speed is above 0.
LiveResult SendLive(SurveySimulator* simulator,
                    const LiveTargets& targets,
                    double speed,
                    const Progress& progress,
                    const LiveFrom& from = {});

}  // namespace seastitch::bench
