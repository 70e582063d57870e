#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

// Counts of rejected and lost data, by reason. Every part of a driver has its own; HEALTH has all.
using Counters = std::map<std::string, std::int64_t>;

}  // namespace seastitch
