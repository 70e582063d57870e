#pragma once

#include <filesystem>

#include "bench/simulator.hpp"

namespace seastitch::bench {

// Where the vehicle's reference point really was: CSV with a head line,
// utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg, in the map frame (North-East-Down at the datum,
// the vehicle starting at x 0, y 0), 20 lines a second. Throws std::runtime_error naming the file.
void WriteTruth(const SurveySimulator& simulator, const std::filesystem::path& path);

// The truth's place beside a log: LOG.truth.csv.
std::filesystem::path TruthPathFor(const std::filesystem::path& log);

}  // namespace seastitch::bench
