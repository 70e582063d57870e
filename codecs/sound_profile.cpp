#include "codecs/sound_profile.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/sensors.hpp"

namespace seastitch {

std::optional<SoundVelocityProfile> ProfileFrom(Time time, std::vector<ProfileRow> rows) {
  for (const ProfileRow& row : rows)
    if (!std::isfinite(row.depth_m) || !std::isfinite(row.speed_mps)) return std::nullopt;
  std::erase_if(rows, [](const ProfileRow& row) { return !IsSoundSpeed(row.speed_mps); });
  if (rows.empty()) return std::nullopt;
  if (rows.front().depth_m > rows.back().depth_m) std::reverse(rows.begin(), rows.end());
  SoundVelocityProfile profile;
  profile.time = time;
  for (const ProfileRow& row : rows) {
    if (!profile.depth_m.empty() && row.depth_m <= profile.depth_m.back()) continue;
    profile.depth_m.push_back(row.depth_m);
    profile.speed_mps.push_back(row.speed_mps);
  }
  return profile;
}

}  // namespace seastitch
