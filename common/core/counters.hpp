#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

// What was refused or lost, by cause. Every part of a driver keeps its own; HEALTH shows them all.
using Counters = std::map<std::string, std::int64_t>;

}  // namespace seastitch
