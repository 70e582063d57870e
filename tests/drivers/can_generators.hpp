#pragma once

#include <rapidcheck.h>

#include <vector>

#include "drivers/can/can_frame.hpp"

namespace rc {

// Any frame that can be on a bus.
template <>
struct Arbitrary<seastitch::CanFrame> {
  static Gen<seastitch::CanFrame> arbitrary() {
    return gen::exec([] {
      seastitch::CanFrame frame;
      frame.error = *gen::weightedElement<bool>({{9, false}, {1, true}});
      frame.extended = !frame.error && *gen::arbitrary<bool>();
      frame.remote = !frame.error && *gen::weightedElement<bool>({{4, false}, {1, true}});
      frame.fd = !frame.error && !frame.remote && *gen::arbitrary<bool>();
      const std::uint32_t beyond = frame.extended || frame.error ? 0x20000000U : 0x800U;
      frame.id = *gen::inRange<std::uint32_t>(0, beyond);
      if (frame.fd) frame.fd_flags = *gen::inRange<std::uint8_t>(0, 4);
      const std::vector<std::uint8_t> lengths = {
          0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
      frame.length = lengths[*gen::inRange<std::size_t>(0, frame.fd ? lengths.size() : 9)];
      for (std::size_t i = 0; i < frame.data().size(); ++i)
        frame.bytes[i] = *gen::arbitrary<std::uint8_t>();
      return frame;
    });
  }
};

}  // namespace rc
