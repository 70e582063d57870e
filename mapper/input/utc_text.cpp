#include "mapper/input/utc_text.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>

namespace seastitch {

std::string UtcOf(Time t) {
  constexpr std::int64_t kDayS = 86'400;
  const auto s = static_cast<std::int64_t>(std::floor(1e-6 * static_cast<double>(ToUtime(t))));
  const auto of_day = static_cast<int>((s % kDayS + kDayS) % kDayS);
  char text[32];
  std::snprintf(
      text, sizeof text, "%02d:%02d:%02d UTC", of_day / 3600, of_day / 60 % 60, of_day % 60);
  return text;
}

}  // namespace seastitch
