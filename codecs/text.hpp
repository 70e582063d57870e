#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/sensors.hpp"

// Small readers that several formats share.
namespace seastitch {

// Up to the first NUL.
std::string TextFromBytes(Bytes bytes);
std::vector<std::string_view> Split(std::string_view text, char separator);
// Without blanks, tabs, returns and newlines at both ends.
std::string_view Trimmed(std::string_view text);
// A finite number and nothing else; "+1.5" too.
std::optional<double> ParseNumber(std::string_view text);
double NumberOr0(const std::map<std::string, std::string>& values, const std::string& key);

// Roll port up, pitch bow up, heading clockwise from north.
Attitude AttitudeFromDegrees(double roll_deg, double pitch_deg, double heading_deg);
Attitude AttitudeFromRadians(double roll_rad, double pitch_rad, double heading_rad);

}  // namespace seastitch
