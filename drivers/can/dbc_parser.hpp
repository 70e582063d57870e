#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/can/dbc.hpp"

namespace seastitch {

// The messages of a DBC file, in its order, with every reference between statements resolved and
// checked. Throws std::runtime_error "FILE:LINE: reason".
std::vector<DbcMessage> ParseDbc(std::string_view text, const std::string& file);

}  // namespace seastitch
