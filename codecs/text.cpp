#include "codecs/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

std::string TextFromBytes(Bytes bytes) {
  return std::string(bytes.begin(), std::find(bytes.begin(), bytes.end(), 0));
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::optional<double> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool usable =
      error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
  return usable ? std::optional(value) : std::nullopt;
}

double NumberOr0(const std::map<std::string, std::string>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? 0.0 : ParseNumber(found->second).value_or(0.0);
}

Attitude AttitudeFromDegrees(double roll_deg, double pitch_deg, double heading_deg) {
  return AttitudeFromRadians(Deg2Rad(roll_deg), Deg2Rad(pitch_deg), Deg2Rad(heading_deg));
}

Attitude AttitudeFromRadians(double roll_rad, double pitch_rad, double heading_rad) {
  Attitude attitude;
  attitude.q_ned_imu = RotationFromRpy(roll_rad, pitch_rad, heading_rad);
  return attitude;
}

}  // namespace seastitch
