#pragma once

#include <cstdint>
#include <vector>

#include "codecs/survey_records.hpp"

// Datagrams of a Kongsberg .all file, little-endian, as an EM 710 writes them: one transmitter, one
// receiver, one positioning and one motion sensor. Each rounds as the format does.
namespace seastitch {

// Datagram of a ping. Beams with equal tilt and delay form a sector. Throws std::invalid_argument
// for more than 2048 beams or 255 sectors.
std::vector<std::uint8_t> EncodeEmN(const MbesPing& ping);
// At most a minute of samples with attitude and heave; angles are the vehicle's. Throws
// std::invalid_argument for none, or a longer time.
std::vector<std::uint8_t> EncodeEmA(const std::vector<NavigationRecord>& samples);
// Position, its sigma, speed and course.
std::vector<std::uint8_t> EncodeEmP(const NavigationRecord& sample);
std::vector<std::uint8_t> EncodeEmU(const SoundVelocityProfile& profile);
// First transmitter and receiver, first active sensors, water line.
std::vector<std::uint8_t> EncodeEmI(const SonarInstallation& installation);

}  // namespace seastitch
