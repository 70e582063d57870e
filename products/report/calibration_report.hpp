#pragma once

#include <string>

#include "products/write_products.hpp"

namespace seastitch {

// HTML of what the overlaps say of the sonar's calibration: sentences and a table of the values as
// configured, as used in this map, and what its overlaps add, for each dive. Empty where nothing
// was estimated.
std::string CalibrationHtml(const Survey& survey, const ProductOptions& options);

}  // namespace seastitch
