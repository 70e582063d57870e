#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

enum class WarningCode : std::uint8_t {
  kPingsLost,            // more than 1 % of the pings are not in the map
  kNoSoundSpeedProfile,  // rays are straight
  kNoWaterLevel,         // of the table or heights that were configured, at the end
  kSonarsOwnSoundings,   // used in place of travel times and angles
  kDepthOfPings,         // used in place of heave or navigation
  kSoundingsNotUsed,     // of a file, since others have raw times and angles
  kFileWithoutRecords,
  kFileCutOff,         // its head states more than it has
  kFileOutOfOrder,     // its parts are not in the order of time
  kOtherInstallation,  // of a file, not used
  kUnitAssumed,        // of depths
  kSensorClock,        // of a file, off the sonar's
  kCalibrated,         // by the survey's own overlaps
  kProfileNotUsed,     // a file of sound speeds that cannot be read, or is of another time
};

// Key for programs; never renamed.
constexpr const char* NameOf(WarningCode code) {
  switch (code) {
    case WarningCode::kPingsLost: return "pings_lost";
    case WarningCode::kNoSoundSpeedProfile: return "no_sound_speed_profile";
    case WarningCode::kNoWaterLevel: return "no_water_level";
    case WarningCode::kSonarsOwnSoundings: return "sonars_own_soundings";
    case WarningCode::kDepthOfPings: return "depth_of_pings";
    case WarningCode::kSoundingsNotUsed: return "soundings_not_used";
    case WarningCode::kFileWithoutRecords: return "file_without_records";
    case WarningCode::kFileCutOff: return "file_cut_off";
    case WarningCode::kFileOutOfOrder: return "file_out_of_order";
    case WarningCode::kOtherInstallation: return "other_installation";
    case WarningCode::kUnitAssumed: return "unit_assumed";
    case WarningCode::kSensorClock: return "sensor_clock";
    case WarningCode::kCalibrated: return "calibrated";
    case WarningCode::kProfileNotUsed: return "profile_not_used";
  }
  return "";
}

// What changes depths or loses data in a map of files: the cause, and a remedy where there is one.
struct MapWarning {
  WarningCode code;
  std::string text;  // one line without a full stop
  // By how much the map is wrong, or would be without what was done [m]; absent: not known.
  std::optional<double> effect_m{};
};

// True if the clock of a sensor is off: what that does to the pings is no latency of the sonar.
inline bool HasWrongClock(const std::vector<MapWarning>& warnings) {
  return std::any_of(warnings.begin(), warnings.end(), [](const MapWarning& warning) {
    return warning.code == WarningCode::kSensorClock;
  });
}

}  // namespace seastitch
