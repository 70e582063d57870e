#pragma once

#include <filesystem>

#include "bench/simulator.hpp"

namespace seastitch::bench {

// Writes the true poses of the vehicle's reference point as CSV with a header line,
// utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg, in the map frame (North-East-Down at the datum;
// the vehicle starts at x 0, y 0), 20 lines per second. Throws std::runtime_error with the name of
// the file.
void WriteTruth(const SurveySimulator& simulator, const std::filesystem::path& path);

// Path of the truth beside a log: LOG.truth.csv.
std::filesystem::path TruthPathFor(const std::filesystem::path& log);

}  // namespace seastitch::bench
