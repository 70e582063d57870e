#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/mbes/mbes_decoder.hpp"

namespace seastitch {

inline void CheckPing(const MbesPing& ping) {
  if (ping.beams.size() > 1024 || !std::isfinite(ping.sound_speed_mps)) std::abort();
  for (const MbesBeam& b : ping.beams)
    for (const float value : {b.twtt_s,
                              b.rx_angle_rad,
                              b.tx_tilt_rad,
                              b.tx_delay_s,
                              b.depth_sigma_ratio,
                              b.backscatter_db})
      if (!std::isfinite(value)) std::abort();
}

using MbesSeal = std::function<void(std::vector<std::uint8_t>* datagram)>;

// A run of datagrams, each behind a length of two bytes, through one decoder. `seal` makes right
// what a fuzzer would hardly guess: sizes, sums.
inline void DecodeRun(const std::string& format, Bytes run, const MbesSeal& seal) {
  MbesDecoderParams params;
  params.format = format;
  MbesDecoder decoder(params);
  ByteReader in(run);
  for (int i = 0; i < 64 && in.left() >= 2; ++i) {
    const std::size_t length = std::min<std::size_t>(in.Le<std::uint16_t>(), in.left());
    const Bytes bytes = in.Take(length);
    std::vector<std::uint8_t> datagram(bytes.begin(), bytes.end());
    seal(&datagram);
    for (const MbesOutput& output : decoder.Add(datagram, FromUtime(1'700'000'000'000'000 + i)))
      if (const auto* ping = std::get_if<MbesPing>(&output)) CheckPing(*ping);
  }
}

}  // namespace seastitch
