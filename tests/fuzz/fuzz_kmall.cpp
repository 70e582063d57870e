#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "drivers/mbes/mbes_decoder.hpp"

namespace {

using namespace seastitch;

// The length words made right, so that the fuzzer gets past them.
std::vector<std::uint8_t> Sealed(Bytes bytes) {
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  if (sealed.size() < 8) return sealed;
  for (std::size_t i = 0; i < 4; ++i)
    sealed[i] = sealed[sealed.size() - 4 + i] = static_cast<std::uint8_t>(sealed.size() >> (8 * i));
  return sealed;
}

void Check(const MbesPing& ping) {
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

}  // namespace

// A run of datagrams, each behind a length of two bytes, through one decoder.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  MbesDecoder decoder({});
  ByteReader in(Bytes(data, size));
  for (int i = 0; i < 64 && in.left() >= 2; ++i) {
    const std::size_t length = std::min<std::size_t>(in.Le<std::uint16_t>(), in.left());
    const auto output = decoder.Add(Sealed(in.Take(length)), FromUtime(1'700'000'000'000'000 + i));
    if (!output) continue;
    if (const auto* ping = std::get_if<MbesPing>(&*output)) Check(*ping);
  }
  return 0;
}
