#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"

// Kongsberg KMALL, little-endian, format revisions up to J: #MRZ (one swath of soundings), #SVP
// (sound velocity profile), and the sensor datagrams #SPO, #SKM and #SVT. Structures are stepped
// over by the sizes that the datagram itself gives.
namespace seastitch {

struct KmallHeader {
  std::uint32_t num_bytes = 0;  // of the datagram or part; encoders set it themselves
  std::array<char, 4> type = {'#', 'M', 'R', 'Z'};
  std::uint8_t version = 3;
  std::uint8_t system_id = 40;
  std::uint16_t echo_sounder_id = 2040;
  std::uint32_t time_s = 0;  // UTC; encoders take it from what they encode
  std::uint32_t time_ns = 0;

  Time time() const;  // to the nearest microsecond
  bool Is(std::string_view name) const { return name == std::string_view(type.data(), 4); }
};

// Nothing unless the bytes begin with a header whose size is that of the bytes.
std::optional<KmallHeader> ReadKmallHeader(Bytes datagram);

// A whole #MRZ of version 0 to 3. Nothing where its sizes do not add up, or where sound speed or
// time make no sense. Beams: main detections in their order, extra detections left out; a
// rejected one has no kBeamValid. A beam that is not finite or not after transmission keeps its
// place as zeros, and is counted in *unusable_beams.
std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams = nullptr);
// The number of the receiver that a whole #MRZ is of: 0 but for a sonar with two heads.
std::size_t ReceiverOfMrz(Bytes datagram);
// Beams are grouped into transmit sectors by equal tilt and delay, at most 255 of them. Throws
// std::invalid_argument for more, and for more than 1024 beams.
std::vector<std::uint8_t> EncodeMrz(const MbesPing& ping, const KmallHeader& header);

// A whole #SVP. Samples that are not deeper than the one before are left out. Nothing where a
// value makes no sense or no sample is left.
std::optional<SoundVelocityProfile> DecodeSvp(Bytes datagram);
std::vector<std::uint8_t> EncodeSvp(const SoundVelocityProfile& profile, const KmallHeader& header);

// #SPO, #SKM and #SVT: what the sonar's own sensors said. Read to be counted; nothing of it is
// published, because under water it is the vehicle's own navigation coming back.
struct KmallPosition {
  Time time;
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;
};
// Nothing also where the position is "not available".
std::optional<KmallPosition> DecodeSpo(Bytes datagram);

struct KmallMotion {
  Time time;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  double heave_m = 0.0;  // positive down
  bool valid = false;    // none of the four is called invalid
};
std::optional<std::vector<KmallMotion>> DecodeSkm(Bytes datagram);

struct KmallSurfaceSoundSpeed {
  Time time;
  double speed_mps = 0.0;
};
std::optional<std::vector<KmallSurfaceSoundSpeed>> DecodeSvt(Bytes datagram);

// For kmall_stream.cpp, which joins the parts of an #MRZ.
inline constexpr std::size_t kKmallHeaderBytes = 20;
inline constexpr std::size_t kKmallPartitionBytes = 4;
inline constexpr std::size_t kKmallTailBytes = 4;
inline constexpr std::uint8_t kNewestMrz = 3;
// The structures fill the datagram from header to tail.
bool IsWholeMrz(Bytes datagram);
// Appends the tail, and writes the size into it and into the first word.
std::vector<std::uint8_t> SealKmall(ByteWriter* out);

}  // namespace seastitch
