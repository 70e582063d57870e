#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "drivers/can/can_frame.hpp"

// One line of a can-utils log: "(1700000000.250000) can0 121#010006FF2BFC".
namespace seastitch {

struct CandumpLine {
  Time time;
  std::string interface;
  CanFrame frame;
};

// Nothing for a line that is not a frame of classic CAN or CAN FD.
std::optional<CandumpLine> ParseCandumpLine(std::string_view line);
// Without the line end.
std::string FormatCandumpLine(const CandumpLine& line);

}  // namespace seastitch
