#pragma once

#include <cstdint>

#include "common/core/time.hpp"

namespace seastitch {

// What a message carries beside the measurement: arrival, and its place in the channel.
struct MessageStamp {
  Time recv;  // by the computer's clock
  std::int64_t seq = 0;
};

}  // namespace seastitch
