#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "page/process_roll.hpp"
#include "seastitch/condition_t.hpp"
#include "seastitch/nav_corrected_t.hpp"

namespace seastitch {

// A process sends HEALTH once a second; after so long without it, it is silent.
inline constexpr double kSilentS = 3.0;

// Where the vehicle is: north and east of the map origin, and the horizontal 1 sigma of that (root
// of the sum of both variances).
struct VehiclePlace {
  std::int64_t utime = 0;
  double north_m = 0.0;
  double east_m = 0.0;
  double sigma_m = 0.0;
  double depth_m = 0.0;
  std::optional<double> altitude_m;
  double heading_deg = 0.0;  // from 0 to below 360
  double speed_mps = 0.0;
};
VehiclePlace PlaceOf(const nav_corrected_t& nav, std::optional<double> altitude_m);

// What was heard of a vehicle.
struct StatusView {
  const ProcessRoll& roll;
  std::optional<VehiclePlace> vehicle;  // absent: not known
  double now_s = 0.0;                   // monotonic, as in the roll
  std::int64_t now_utime = 0;
};

// The dive that is recorded, as the logger reports it.
struct RecordedDive {
  std::optional<std::int64_t> start_utime;
  std::optional<std::int64_t> disk_free_mb;
};
// Absent: no logger is heard.
std::optional<RecordedDive> DiveOf(const StatusView& view);

// The state of a process in a word.
const char* StateOf(const health_t& health);
// Datagrams and events that it lost.
std::int64_t DropsOf(const health_t& health);
// What to do about a fault. Empty for a fault of another version of the program.
std::string RemedyOf(const condition_t& condition);

// True if every process of kProcesses (and each of kOptionalProcesses that sends) sends HEALTH,
// runs once, and is ok.
bool AllOk(const ProcessRoll& roll, double now_s);

// The view as one JSON object, for programs and the page (docs/listening.md).
std::string StatusJson(const StatusView& view);

}  // namespace seastitch
