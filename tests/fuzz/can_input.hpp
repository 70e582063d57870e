#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "drivers/can/signal_map.hpp"
#include "drivers/device_clock.hpp"
#include "tests/support/paths.hpp"

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

// A device as it is shipped: a DBC file of config/, and its signals in the order of the fields.
template <class Params>
Params ShippedParams(const std::string& dbc_file,
                     const std::vector<std::string>& signals,
                     DeviceClock clock) {
  const Dbc dbc = Dbc::Load(ConfigFile(dbc_file));
  Params params;
  for (std::size_t field = 0; field < signals.size(); ++field)
    params.signals.Assign(dbc, field, signals[field]);
  params.clock.clock = clock;
  return params;
}

// Runs a decoder on a fuzzer's bytes: the first chooses the clock, the others are frames. `check`
// aborts where what the decoder gave makes no sense.
template <class Decoder, class Params, class Check>
void DecodeFrames(Bytes input, const Params& device, const Params& model, Check check) {
  if (input.empty()) return;
  Decoder decoder(input[0] % 2 == 0 ? device : model);
  const std::vector<CanFilter> ids = decoder.filters();
  for (const ReceivedFrame& received : FramesOf(input.subspan(1), ids))
    check(decoder.Add(received.frame, received.recv));
  decoder.Finish();
}

}  // namespace seastitch
