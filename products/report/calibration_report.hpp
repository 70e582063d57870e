#pragma once

#include <string>

#include "products/report/report.hpp"

namespace seastitch {

// HTML of what the overlaps say of the sonar's calibration: sentences and a table of the values as
// configured, as used in this map, and what its overlaps add, for each dive. Empty where nothing
// was estimated.
std::string CalibrationHtml(const Report& report);

}  // namespace seastitch
