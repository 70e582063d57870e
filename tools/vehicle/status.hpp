#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "seastitch/nav_corrected_t.hpp"
#include "tools/vehicle/process_roll.hpp"

namespace seastitch {

// One line of where the vehicle is: north and east of the map origin, depth, altitude, heading,
// speed, and the horizontal 1 sigma of the position (root of the sum of both variances).
std::string VehicleLine(const nav_corrected_t& nav, std::optional<double> altitude_m);

// Text of `seastitch status`: the dive, where the vehicle is (empty: not known), one line per
// process, then the faults that are present with their remedies. No line is longer than `columns`.
// now_s: monotonic, as in the roll.
std::vector<std::string> StatusLines(const ProcessRoll& roll,
                                     const std::string& vehicle,
                                     double now_s,
                                     std::int64_t now_utime,
                                     std::size_t columns);

// True if every process of kProcesses (and the nav-driver, if it sends) sends HEALTH, runs once,
// and is ok.
bool AllOk(const ProcessRoll& roll, double now_s);

struct StatusOptions {
  std::string lcm_url;
  bool once = false;  // as if the output were no terminal
};

// `seastitch status`: on a terminal every second until a signal; else once, after 2.5 s. Returns
// EXIT_SUCCESS if all were ok at the end, else EXIT_FAILURE.
int RunStatus(const StatusOptions& options);

}  // namespace seastitch
