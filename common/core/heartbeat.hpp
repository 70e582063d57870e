#pragma once

#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Sign of life of a process (HEALTH), with the two clocks of its computer at the same instant.
struct Heartbeat {
  std::string process;    // such as mapper
  Time time;              // by the system's clock, which may be set
  double uptime_s = 0.0;  // since the process started, by the monotonic clock
};

}  // namespace seastitch
