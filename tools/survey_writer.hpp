#pragma once

#include <cstdint>
#include <filesystem>

namespace seastitch {

struct SurveyWriterOptions {
  std::filesystem::path log;            // LCM log of a survey, such as the bench writes
  std::filesystem::path mapper_config;  // vehicle and data sheets of the INS
  std::filesystem::path file;           // to be written: .kmall, .all or .s7k
  double motion_rate_hz = 50.0;         // #SKM, A, 1016
  double position_rate_hz = 5.0;        // #SPO, P, 1003
};

struct SurveyWriterResult {
  std::int64_t pings = 0;
  std::int64_t motions = 0;
  std::int64_t positions = 0;
  std::int64_t fixes = 0;  // jumps of the position
};

// The survey as the file of a sonar on a vehicle whose INS navigates by itself, in the format that
// its name ends with: installation, sound speed profile, raw times and angles, attitude with heave,
// position, and where the format has it velocity. The INS is our own dead reckoning of the log's
// inertial unit, Doppler log and pressure sensor, so that it drifts as that does. Each POSITION_FIX
// of the log sets its position: it jumps. Heave is the depth of the vehicle (water line 0).
// Throws std::runtime_error naming the file.
SurveyWriterResult WriteSurveyFile(const SurveyWriterOptions& options);
// Whether there is a format that a name ends with.
bool CanWriteSurveyFile(const std::filesystem::path& file);

}  // namespace seastitch
