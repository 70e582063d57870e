#include "mapper/health/stamp_offset_record.hpp"

namespace seastitch {

void StampOffsetRecord::Look(const Navigation& navigation) {
  const std::optional<Time> latest = navigation.latest();
  if (!latest || latest == looked_) return;
  const double dt_s = looked_ ? ToSeconds(*latest - *looked_) : 0.0;
  looked_ = latest;
  for (const SuspectedOffset& offset : navigation.suspected_offsets()) {
    Best& best = best_.try_emplace(offset.sensor, Best{offset}).first->second;
    if (offset.sigma_s < best.offset.sigma_s) best.offset = offset;
    best.suspected_s += dt_s;
  }
}

std::vector<StampOffsetEstimate> StampOffsetRecord::estimates() const {
  std::vector<StampOffsetEstimate> estimates;
  for (const auto& [sensor, best] : best_) {
    const bool is_dvl = sensor == NavSensor::kDvl;
    estimates.push_back(
        {is_dvl ? "navigation.dvl_time_offset_s" : "navigation.attitude_time_offset_s",
         is_dvl ? params_.dvl_time_offset_s : params_.attitude_time_offset_s,
         best.offset.add_s,
         best.offset.sigma_s,
         best.suspected_s});
  }
  return estimates;
}

}  // namespace seastitch
