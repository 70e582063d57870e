#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/kmall_frame.hpp"
#include "codecs/survey_records.hpp"
#include "common/core/sensors.hpp"

// Kongsberg KMALL, little-endian, format revisions up to J: #MRZ, one swath of soundings. Its
// structures are stepped over by the sizes that the datagram itself gives.
namespace seastitch {

inline constexpr std::uint8_t kNewestMrz = 3;
// The structures fill the datagram from header to tail.
bool IsWholeMrz(Bytes datagram);

// A whole #MRZ of version 0 to 3. Nothing where its sizes do not add up, or where sound speed or
// time make no sense. Beams: main detections in their order, extra detections left out; a
// rejected one has no kBeamValid. A beam that is not finite or not after transmission keeps its
// place as zeros, and is counted in *unusable_beams.
std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams = nullptr);
// The same beams where the sonar itself placed them, in the same order. Nothing also for a ping
// without a valid sounding.
std::optional<PlacedPing> DecodeMrzSoundings(Bytes datagram);
// Beams are grouped into transmit sectors by equal tilt, delay and array, at most 255 of them.
// Throws std::invalid_argument for more, and for more than 1024 beams.
std::vector<std::uint8_t> EncodeMrz(const MbesPing& ping, const KmallHeader& header);

}  // namespace seastitch
