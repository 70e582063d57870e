#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "page/vehicle_status.hpp"

namespace seastitch {

std::string VehicleLine(const VehiclePlace& place);

// Text of `seastitch status`: the dive, where the vehicle is, one line per process, then the faults
// that are present with their remedies. No line is longer than `columns`.
std::vector<std::string> StatusLines(const StatusView& view, std::size_t columns);

struct StatusOptions {
  std::string lcm_url;
  bool once = false;  // as if the output were no terminal
  bool json = false;  // once, as JSON
};

// `seastitch status`: on a terminal every second until a signal; else once, after 2.5 s. Returns
// EXIT_SUCCESS if all were ok at the end, else EXIT_FAILURE.
int RunStatus(const StatusOptions& options);

}  // namespace seastitch
