#pragma once

#include <optional>
#include <vector>

#include "codecs/makers/s7k.hpp"
#include "codecs/survey_records.hpp"

// Decoders of 7k sensor records. The records' axes are x starboard, y forward, z up, and their
// heave is positive up; results are in our axes (forward, starboard, down).
namespace seastitch {

// Position (1003), geographic or in a map grid, at the time of the fix (stamp less latency).
std::optional<NavigationRecord> DecodeS7k1003(const S7kRecord& record);
std::optional<NavigationRecord> DecodeS7k1012(const S7kRecord& record);  // roll, pitch, heave
std::optional<NavigationRecord> DecodeS7k1013(const S7kRecord& record);  // heading
// Position, heading, and speed and course over ground as its velocity.
std::optional<NavigationRecord> DecodeS7k1015(const S7kRecord& record);
std::optional<std::vector<NavigationRecord>> DecodeS7k1016(const S7kRecord& record);  // attitude
std::optional<SoundVelocityProfile> DecodeS7k1009(const S7kRecord& record);
std::optional<SonarInstallation> DecodeS7k7030(const S7kRecord& record);

}  // namespace seastitch
