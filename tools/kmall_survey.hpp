#pragma once

#include <cstdint>
#include <filesystem>

namespace seastitch {

struct KmallSurveyOptions {
  std::filesystem::path log;            // LCM log of a survey, such as the bench writes
  std::filesystem::path mapper_config;  // vehicle and data sheets of the INS
  std::filesystem::path kmall;          // to be written
  double motion_rate_hz = 50.0;         // #SKM
  double position_rate_hz = 5.0;        // #SPO
};

struct KmallSurveyResult {
  std::int64_t pings = 0;
  std::int64_t motions = 0;
  std::int64_t positions = 0;
  std::int64_t fixes = 0;  // jumps of the position
};

// The survey as the .kmall of a vehicle whose INS navigates by itself: #IIP, #SVP, #MRZ, #SKM with
// attitude, velocity and heave, #SPO with position. The INS is our own dead reckoning of the log's
// inertial unit, Doppler log and pressure sensor, so that it drifts as that does. Each POSITION_FIX
// of the log sets its position: it jumps. Heave is the depth of the vehicle (#IIP: water line 0).
// Throws std::runtime_error naming the file.
KmallSurveyResult WriteKmallSurvey(const KmallSurveyOptions& options);

}  // namespace seastitch
