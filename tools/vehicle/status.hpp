#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/vehicle/process_roll.hpp"

namespace seastitch {

// Text of `seastitch status`: the dive, one line per process, then the faults that are present with
// their remedies. No line is longer than `columns`. now_s: monotonic, as in the roll.
std::vector<std::string> StatusLines(const ProcessRoll& roll,
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
