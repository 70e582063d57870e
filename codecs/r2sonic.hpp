#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/mbes_codec.hpp"

// R2Sonic BTH0, big-endian: one ping a datagram, in sections with names. Sections that are not
// known are stepped over by their size.
namespace seastitch {

// Nothing where sizes do not add up, a section that a ping needs is missing (H0, R0, A0 or A2), or
// sound speed or time make no sense. Beams: port first. Valid: found by amplitude or phase, and
// both quality tests passed. *unusable_beams as in DecodeMrz.
std::optional<MbesPing> DecodeBth0(Bytes datagram, int* unusable_beams = nullptr);
// One tilt for all beams, that of the first; delays are not in this format. Angles to 1 part in
// 65535 of the largest step between two beams, times to 1 part in 65535 of the longest. Throws
// std::invalid_argument for more than 1024 beams, or angles that do not rise.
std::vector<std::uint8_t> EncodeBth0(const MbesPing& ping);

class R2SonicStream : public MbesCodec {
 public:
  explicit R2SonicStream(const MbesCodecParams& /*params*/) {}

  std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) override;
  // r2sonic_malformed, r2sonic_ignored (packets that are not BTH0), mbes_beam_unusable.
  Counters counters() const override { return counters_; }

 private:
  Counters counters_;
};

}  // namespace seastitch
