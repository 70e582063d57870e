#pragma once

#include <cstdint>
#include <filesystem>

#include "mapper/mapper_config.hpp"

namespace seastitch {

struct SurveyWriterOptions {
  std::filesystem::path log;      // LCM log of a survey, such as one written by the bench
  MapperConfig ins;               // vehicle, start and data sheets of the INS
  std::filesystem::path file;     // to be written: .kmall, .all or .s7k
  double motion_rate_hz = 50.0;   // #SKM, A, 1016
  double position_rate_hz = 5.0;  // #SPO, P, 1003 and 1015
  // Positions state the INS's velocity. Without, .s7k has 1003 alone, and so no velocity at all.
  bool velocity_with_position = true;
};

struct SurveyWriterResult {
  std::int64_t pings = 0;
  std::int64_t motions = 0;
  std::int64_t positions = 0;
  std::int64_t fixes = 0;  // jumps of the position
};

// Writes a survey as a file of a sonar on a vehicle with an INS, in the format of the file name's
// extension: installation, sound-speed profile, travel times and angles, attitude with heave,
// position and velocity. The INS is simulated by our dead reckoning of the
// log's inertial unit, DVL and pressure sensor, so that it drifts in the same way. Each
// POSITION_FIX of the log sets its position, which then jumps. Heave is the depth of the vehicle
// (water line 0). Throws std::runtime_error with the name of the file.
SurveyWriterResult WriteSurveyFile(const SurveyWriterOptions& options);
// True if a format has this extension.
bool CanWriteSurveyFile(const std::filesystem::path& file);

}  // namespace seastitch
