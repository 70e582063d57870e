#pragma once

#include <string>

#include "common/core/time.hpp"

namespace seastitch {

// Time of day, such as "12:34:56 UTC".
std::string UtcOf(Time t);

}  // namespace seastitch
