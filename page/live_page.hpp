#pragma once

#include <string>

namespace seastitch {

// The page of a vehicle: HTML with its style and scripts, always the same.
const std::string& LivePage();
// Its Content-Security-Policy.
const std::string& LivePagePolicy();

}  // namespace seastitch
