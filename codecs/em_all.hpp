#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/bytes.hpp"

// Datagrams of Kongsberg's .all files (EM 122 to EM 2040C, SIS 4), little- or big-endian.
namespace seastitch {

// A datagram whose frame, checksum and date are right. It is called by its letter.
struct EmDatagram {
  char type = 0;
  std::uint16_t model = 0;  // 710, 2040, 2045 (EM 2040C)
  Time time;                // of its first sample, or of the ping
  std::uint16_t counter = 0;
  std::uint16_t serial = 0;  // of the system or the receiver
  bool big_endian = false;
  Bytes body;  // behind the serial number, before ETX
};

// From length to checksum, the length's four bytes with it: in the byte order in which it is
// right. Nothing: in neither.
std::optional<EmDatagram> ReadEmDatagram(Bytes datagram);

// Receivers: N and X of the first have the serial number of the system (head 0), those of the
// second another (head 1).
//
// Beams in the datagram's order. *unusable_beams as in DecodeMrz.
std::optional<MbesPing> DecodeEmN(const EmDatagram& datagram,
                                  std::uint8_t head,
                                  int* unusable_beams = nullptr);

// The same beams as the sonar placed them. x, y from the active positioning point; z from the
// transmitter at the time of the ping.
std::optional<PlacedPing> DecodeEmX(const EmDatagram& datagram,
                                    std::uint8_t head,
                                    const SonarInstallation& installation);

// Angles of the vehicle: the sonar has already applied the motion sensor's mounting and delay.
// Without what the sensor calls invalid.
std::optional<std::vector<NavigationRecord>> DecodeEmA(const EmDatagram& datagram);
std::optional<std::vector<NavigationRecord>> DecodeEmNetworkAttitude(const EmDatagram& datagram);

// At the time of the receiver's own message where the sonar uses that, less the delay that the
// installation gives; else of arrival. Nothing also where there is no position.
std::optional<NavigationRecord> DecodeEmP(const EmDatagram& datagram,
                                          const SonarInstallation& installation);

// h: the water line's height, as the sonar made it of what its positioning system states.
std::optional<NavigationRecord> DecodeEmHeight(const EmDatagram& datagram);
std::optional<SoundVelocityProfile> DecodeEmU(const EmDatagram& datagram);
std::optional<std::vector<SurfaceSoundSpeed>> DecodeEmG(const EmDatagram& datagram);

// Sensors: "P1" to "P3" and "MS", "NS", whose angles are left out, as they are applied already.
std::optional<SonarInstallation> DecodeEmI(const EmDatagram& datagram);
// Where positions, and with them the soundings of X, are referred to: the active positioning
// system's place, on the water line.
Eigen::Vector3d EmSoundingOrigin(const SonarInstallation& installation);

}  // namespace seastitch
