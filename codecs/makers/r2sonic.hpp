#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/mbes_codec.hpp"

// R2Sonic BTH0, big-endian: one ping per datagram, in named sections. Unknown sections are skipped
// by their size.
namespace seastitch {

// Decodes a ping. Absent where sizes are inconsistent, a required section is missing (H0, R0, A0 or
// A2), or sound speed or time are out of range. Beams: port first. Valid: found by amplitude or
// phase, and both quality tests passed. *unusable_beams: as DecodeMrz().
std::optional<MbesPing> DecodeBth0(Bytes datagram, int* unusable_beams = nullptr);
// Encodes a ping. The format has one tilt for all beams, here that of the first, and no transmit
// delays. Resolution: angles 1/65535 of the largest step between two beams, travel times 1/65535 of
// the longest. Throws std::invalid_argument for more than 1024 beams, or angles that do not rise.
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
