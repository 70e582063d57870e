#pragma once

#include <cstdint>

#include "common/core/time.hpp"

namespace seastitch {

// Receive time and sequence number that a message has in addition to the measurement.
struct MessageStamp {
  Time recv;  // receive time by the computer's clock
  std::int64_t seq = 0;
};

}  // namespace seastitch
