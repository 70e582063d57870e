#pragma once

#include <cstdint>
#include <vector>

#include "codecs/survey_records.hpp"

// Encoders of the sensor records of a Teledyne .s7k file (pings: codecs/makers/s7k.hpp).
namespace seastitch {

std::vector<std::uint8_t> EncodeS7k1003(const NavigationRecord& sample);
// Position with height above the ellipsoid, speed and course, and heading. What the sample lacks is
// zero.
std::vector<std::uint8_t> EncodeS7k1015(const NavigationRecord& sample);
// 1 to 255 samples with attitude and heave, within 65 s. Throws std::invalid_argument otherwise.
std::vector<std::uint8_t> EncodeS7k1016(const std::vector<NavigationRecord>& samples);
std::vector<std::uint8_t> EncodeS7k1009(const SoundVelocityProfile& profile);
// Installation: first transmitter and receiver, sensors at the reference point, water line.
std::vector<std::uint8_t> EncodeS7k7030(const SonarInstallation& installation);

}  // namespace seastitch
