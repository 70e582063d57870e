#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/frame_stream.hpp"
#include "codecs/mbes_codec.hpp"

// Norbit WBMS, little-endian: packets with a CRC, one behind the other on a TCP connection.
namespace seastitch {

// Size of the packet at the beginning, as FrameStream::SizeOf.
std::optional<std::size_t> SizeOfWbms(Bytes bytes);
enum class WbmsKind : std::uint8_t { kBathymetry, kOtherVersion, kOther };
// packet: whole, as SizeOfWbms() gives it.
WbmsKind KindOfWbms(Bytes packet);
// Decodes a bathymetry packet, versions 4 to 8. Absent for inconsistent sizes or an implausible
// sound speed, sampling rate or time. Valid: found by amplitude or phase, and both quality tests
// passed. *unusable_beams as in DecodeMrz.
std::optional<MbesPing> DecodeWbms(Bytes packet, int* unusable_beams = nullptr);
// Version 5. One tilt for all beams, that of the first; delays are not in this format. Throws
// std::invalid_argument for more than 1024 beams.
std::vector<std::uint8_t> EncodeWbms(const MbesPing& ping);

class WbmsStream : public MbesCodec {
 public:
  explicit WbmsStream(const MbesCodecParams& /*params*/) : frames_(SizeOfWbms) {}

  // payload: of any size, wherever the connection cut it.
  std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) override;
  // wbms_malformed, wbms_version_unknown, wbms_ignored (packets that are not bathymetry),
  // wbms_skipped_bytes (of no packet), mbes_beam_unusable.
  Counters counters() const override;

 private:
  FrameStream frames_;
  Counters counters_;
};

}  // namespace seastitch
