#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/kongsberg/kmall_frame.hpp"
#include "codecs/survey_records.hpp"

// KMALL's datagrams beside the soundings: #SVP (profile), #SPO (position), #SKM (motion), #SCL
// (clock), #SVT (sound speed at the transducer), #IIP (installation), #IOP (settings).
namespace seastitch {

// Decodes a whole #SVP. Its time is that of the cast, the datagram's at the latest. Rows:
// ProfileFrom().
std::optional<SoundVelocityProfile> DecodeSvp(Bytes datagram);
std::vector<std::uint8_t> EncodeSvp(const SoundVelocityProfile& profile, const KmallHeader& header);

// Position and height (#SPO). Its time is that of the sensor's own message where the sonar uses it,
// else the time of arrival. Absent also where the position is "not available".
std::optional<NavigationRecord> DecodeSpo(Bytes datagram);

// Motion (#SKM): one sample per sample of the sensor, at its own time, without values that are
// flagged invalid. Attitude: raw angles of the sensor, roll port up, pitch bow up.
std::optional<std::vector<NavigationRecord>> DecodeSkm(Bytes datagram);

// A single motion sample as a sensor sends it to the sonar ("KM binary", #KMB): 132 bytes without a
// checksum. SizeOfKmBinary is a FrameStream::SizeOf.
std::optional<std::size_t> SizeOfKmBinary(Bytes bytes);
std::optional<NavigationRecord> DecodeKmBinary(Bytes datagram);
// The same samples as the sonar sends them on: one #KMB, or the many of a #SKM.
std::optional<std::size_t> SizeOfKmMotion(Bytes bytes);
std::optional<std::vector<NavigationRecord>> DecodeKmMotion(Bytes datagram);

// One datagram of position, height and quality of positioning system 0 ("#SPO0"), by the sensor's
// own time.
std::vector<std::uint8_t> EncodeSpo(const NavigationRecord& sample, const KmallHeader& header);
// One datagram of 1 to 148 samples of motion sensor 0 ("#SKM0"). Absent values are flagged invalid.
// Throws std::invalid_argument for any other number.
std::vector<std::uint8_t> EncodeSkm(const std::vector<NavigationRecord>& samples,
                                    const KmallHeader& header);
// #IIP: first transmitter and receiver, one positioning and one motion sensor, both active and at
// the given lever arm, and the water line.
std::vector<std::uint8_t> EncodeIip(const SonarInstallation& installation,
                                    const KmallHeader& header);

// Clock (#SCL): the datagram's time beside that of the ZDA sentence in it, to a millisecond or so.
std::optional<ClockComparison> DecodeScl(Bytes datagram);

std::optional<std::vector<SurfaceSoundSpeed>> DecodeSvt(Bytes datagram);

// Transmitters and receivers with their arrays, positioning and motion sensors, water line.
std::optional<SonarInstallation> DecodeIip(Bytes datagram);
std::optional<SonarSettings> DecodeIop(Bytes datagram);

}  // namespace seastitch
