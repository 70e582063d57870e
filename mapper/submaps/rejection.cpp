#include "mapper/submaps/rejection.hpp"

#include <algorithm>
#include <cstdio>

namespace seastitch {

std::string Rejection::Text() const {
  char percent[32];
  std::snprintf(percent, sizeof percent, "%.1f %%", 100.0 * part);
  const std::string text = std::string(percent) + " of soundings rejected";
  return part > kUnusual ? text + ", most of them " + main_reason : text;
}

Rejection RejectionOf(std::int64_t valid_soundings,
                      const std::map<std::string, std::int64_t>& counters) {
  Rejection rejection;
  std::int64_t rejected = 0;
  std::int64_t most = 0;
  for (const auto& [name, count] : counters) {
    if (name != "beams_refused" && !name.starts_with("soundings_")) continue;
    rejected += count;
    if (count > most) rejection.main_reason = name;
    most = std::max(most, count);
  }
  if (valid_soundings > 0)
    rejection.part = static_cast<double>(rejected) / static_cast<double>(valid_soundings);
  return rejection;
}

}  // namespace seastitch
