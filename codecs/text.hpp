#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"

// Functions on text and numbers that several formats share.
namespace seastitch {

// The text up to the first NUL.
std::string TextFromBytes(Bytes bytes);
std::vector<std::string_view> Split(std::string_view text, char separator);
// The text without blanks, tabs, returns and newlines at both ends.
std::string_view Trimmed(std::string_view text);
// The number that the whole text is ("+1.5", too). Absent where it is anything else, or not finite.
std::optional<double> ParseNumber(std::string_view text);
double NumberOr0(const std::map<std::string, std::string>& values, const std::string& key);

// Attitude from roll (port up), pitch (bow up) and heading (clockwise from north).
Attitude AttitudeFromDegrees(double roll_deg, double pitch_deg, double heading_deg);
Attitude AttitudeFromRadians(double roll_rad, double pitch_rad, double heading_rad);

}  // namespace seastitch
