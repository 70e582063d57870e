#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/kongsberg/kmall_frame.hpp"
#include "codecs/survey_records.hpp"
#include "common/core/sensors.hpp"

// Kongsberg KMALL, little-endian, format revisions up to J: #MRZ, one swath of soundings. The sizes
// of its structures are taken from the datagram.
namespace seastitch {

inline constexpr std::uint8_t kNewestMrz = 3;
// The structures fill the datagram from header to tail.
bool IsWholeMrz(Bytes datagram);

// Decodes a whole #MRZ, of any version with these structures. Absent where its sizes are
// inconsistent, or sound speed or time are out of range. Beams: the main detections in their order,
// without extra detections. A rejected detection has no kBeamValid. A beam with a value that is not
// finite, or a travel time that is not positive, becomes all zeros and is counted in
// *unusable_beams.
std::optional<MbesPing> DecodeMrz(Bytes datagram, int* unusable_beams = nullptr);
// The same beams as soundings that the sonar ray traced, in the same order. Absent also for a ping
// without a valid sounding.
std::optional<PlacedPing> DecodeMrzSoundings(Bytes datagram);
// Position and height of the vessel's reference point, and its heading, at the time of the ping, as
// the sonar has interpolated them ("#MRZ"). Roll and pitch are not stated, and 0: the sonar's
// soundings need none. Absent where it had no position.
std::optional<NavigationRecord> DecodeMrzNavigation(Bytes datagram);
// Encodes a #MRZ. Beams are grouped into transmit sectors by equal tilt, delay and array. Throws
// std::invalid_argument for more than 255 sectors or more than 1024 beams.
std::vector<std::uint8_t> EncodeMrz(const MbesPing& ping, const KmallHeader& header);

}  // namespace seastitch
