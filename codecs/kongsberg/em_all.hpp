#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/bytes.hpp"

// Datagrams of Kongsberg's .all files (EM 122 to EM 2040C, SIS 4), little- or big-endian.
namespace seastitch {

// A datagram whose frame, checksum and date are valid. Its type is a letter.
struct EmDatagram {
  char type = 0;
  std::uint16_t model = 0;  // 710, 2040, 2045 (EM 2040C)
  Time time;                // of its first sample, or of the ping
  std::uint16_t counter = 0;
  std::uint16_t serial = 0;  // of the system or the receiver
  bool big_endian = false;
  Bytes body;  // after the serial number, before ETX
};

// Checks a datagram from its length field to its checksum, both included. Takes the byte order in
// which it is valid; absent where it is valid in neither.
std::optional<EmDatagram> ReadEmDatagram(Bytes datagram);

// Raw ping (N). Head 0: the serial number is that of the system, which the first receiver shares.
// Head 1: any other. Beams in the datagram's order. *unusable_beams: as DecodeMrz().
std::optional<MbesPing> DecodeEmN(const EmDatagram& datagram,
                                  std::uint8_t head,
                                  int* unusable_beams = nullptr);

// The same ping as ray traced by the sonar (X). x, y from the active positioning point; z from the
// transmitter at the time of the ping.
std::optional<PlacedPing> DecodeEmX(const EmDatagram& datagram,
                                    std::uint8_t head,
                                    const SonarInstallation& installation);

// A ping as ray traced by an older sonar, such as the EM 3002 (D). Origin: as X. All beams are
// valid.
std::optional<PlacedPing> DecodeEmD(const EmDatagram& datagram,
                                    std::uint8_t head,
                                    const SonarInstallation& installation);

// The heading that X and D state, as an attitude without roll and pitch (source "em_ping"): their
// soundings are level. For files without an attitude.
std::optional<NavigationRecord> DecodeEmPingHeading(const EmDatagram& datagram);

// Attitude (A, n): angles of the vehicle, since the sonar has already applied the motion sensor's
// mounting and delay. Values that the sensor flags invalid are left out.
std::optional<std::vector<NavigationRecord>> DecodeEmA(const EmDatagram& datagram);
std::optional<std::vector<NavigationRecord>> DecodeEmNetworkAttitude(const EmDatagram& datagram);

// Position (P). Its time is that of the positioning sensor's own message where the sonar was set to
// use it, less the delay that the installation states; else the time of arrival. Absent also where
// the datagram has no position.
std::optional<NavigationRecord> DecodeEmP(const EmDatagram& datagram,
                                          const SonarInstallation& installation);

// h: the water line's height, as the sonar made it of what its positioning system states.
std::optional<NavigationRecord> DecodeEmHeight(const EmDatagram& datagram);
// Clock (C): the sonar's beside the external one. Absent where there is no external one.
std::optional<ClockComparison> DecodeEmC(const EmDatagram& datagram);
std::optional<SoundVelocityProfile> DecodeEmU(const EmDatagram& datagram);
std::optional<std::vector<SurfaceSoundSpeed>> DecodeEmG(const EmDatagram& datagram);

// Installation (I). Sensors: "P1" to "P3" (positioning), "MS" and "NS" (motion). The angles of
// motion sensors are left out, because the sonar has already applied them.
std::optional<SonarInstallation> DecodeEmI(const EmDatagram& datagram);
// Reference point of positions and of the soundings of X: the active positioning system, at the
// height of the water line.
Eigen::Vector3d EmSoundingOrigin(const SonarInstallation& installation);

}  // namespace seastitch
