#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "seastitch/nav_corrected_t.hpp"
#include "tools/vehicle/process_roll.hpp"

namespace seastitch {

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
std::string VehicleLine(const VehiclePlace& place);

// What `seastitch status` has heard.
struct StatusView {
  const ProcessRoll& roll;
  std::optional<VehiclePlace> vehicle;  // absent: not known
  double now_s = 0.0;                   // monotonic, as in the roll
  std::int64_t now_utime = 0;
};

// Text of `seastitch status`: the dive, where the vehicle is, one line per process, then the faults
// that are present with their remedies. No line is longer than `columns`.
std::vector<std::string> StatusLines(const StatusView& view, std::size_t columns);
// The same as one JSON object, for programs (docs/listening.md).
std::string StatusJson(const StatusView& view);

// True if every process of kProcesses (and each of kOptionalProcesses that sends) sends HEALTH,
// runs once, and is ok.
bool AllOk(const ProcessRoll& roll, double now_s);

struct StatusOptions {
  std::string lcm_url;
  bool once = false;  // as if the output were no terminal
  bool json = false;  // once, as JSON
};

// `seastitch status`: on a terminal every second until a signal; else once, after 2.5 s. Returns
// EXIT_SUCCESS if all were ok at the end, else EXIT_FAILURE.
int RunStatus(const StatusOptions& options);

}  // namespace seastitch
