#pragma once

#include <cstdint>
#include <string>

#include "bench/log.hpp"
#include "bench/simulator.hpp"

namespace seastitch::bench {

// "HOST:PORT" each: where the drivers listen. CAN goes as cannelloni packets, one a burst.
struct LiveTargets {
  std::string imu;
  std::string dvl;
  std::string mbes;
  std::string lcm_url{};  // of position fixes, which have no driver; empty: as Bus takes it
};

struct LiveResult {
  std::int64_t packets = 0;
  std::int64_t bytes = 0;
  std::int64_t refused = 0;  // no receiver, or refused by the kernel
  double wall_s = 0.0;
  double max_lag_s = 0.0;  // of a packet behind its time: how far the machine fell behind
};

// Start of a live survey within it, such as after a power cut of the vehicle.
struct LiveFrom {
  double survey_s = 0.0;  // nothing before this second of it is sent, but for the sonar's profile
  bool now = false;       // nor what lies in the past by the system clock
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
