#pragma once

#include <algorithm>
#include <vector>

#include "drivers/can/can_frame.hpp"

namespace seastitch {

// A fuzzer's bytes as frames that a decoder wants, at times that mostly rise: of each frame a byte
// that chooses its id, one for its length, two for the microseconds (64 a step) since the last,
// data.
inline std::vector<ReceivedFrame> FramesOf(Bytes input, const std::vector<CanFilter>& ids) {
  std::vector<ReceivedFrame> frames;
  ByteReader in(input);
  Time now = FromUtime(1'700'000'000'000'000);
  while (in.left() >= 4) {
    ReceivedFrame& received = frames.emplace_back();
    const CanFilter& id = ids[in.Le<std::uint8_t>() % ids.size()];
    received.frame.id = id.id;
    received.frame.extended = id.extended;
    const std::size_t length = std::min<std::size_t>(in.Le<std::uint8_t>() % 65, in.left() - 2);
    now += 64 * Duration(in.Le<std::int16_t>());
    received.recv = now;
    received.frame.fd = length > 8;
    received.frame.SetData(in.Take(length));
  }
  return frames;
}

}  // namespace seastitch
