#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/vehicle/process_roll.hpp"

namespace seastitch {

// What `seastitch status` shows: the dive, one line a process, then the faults that hold with what
// to do about them. No line is wider than `columns`. now_s: monotonic, as of the roll.
std::vector<std::string> StatusLines(const ProcessRoll& roll,
                                     double now_s,
                                     std::int64_t now_utime,
                                     std::size_t columns);

// True where every process of kProcesses sends HEALTH, no two of one name, and is ok; so for the
// nav-driver where it was heard.
bool AllOk(const ProcessRoll& roll, double now_s);

struct StatusOptions {
  std::string lcm_url;
  bool once = false;  // as where the output is no terminal
};

// `seastitch status`: to a terminal every second until a signal; else once, after 2.5 s. Gives
// EXIT_SUCCESS where all were ok at the end, else EXIT_FAILURE.
int RunStatus(const StatusOptions& options);

}  // namespace seastitch
