#include "mapper/registration/prepared_submaps.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/mounting.hpp"

namespace seastitch {
namespace {

// A step moves the end of a submap of 50 m by 3 mm. In whole steps, so that a submap is not
// prepared again for every new estimate.
constexpr double kYawStepRad = Deg2Rad(0.01);

std::int32_t YawSteps(double added_yaw_rad) {
  return static_cast<std::int32_t>(std::lround(added_yaw_rad / kYawStepRad));
}

}  // namespace

std::size_t PreparedSubmaps::Prepared::Bytes() const {
  std::size_t bytes = sizeof(Prepared) + sizeof(RegistrationSubmap);
  for (const RegistrationSubmap::Level& level : submap->levels())
    bytes += level.grid.geometry().size() * sizeof(RegistrationSubmap::Cell);
  return bytes;
}

std::shared_ptr<const RegistrationSubmap> PreparedSubmaps::Find(SubmapId id, double added_yaw_rad) {
  const std::int32_t steps = YawSteps(added_yaw_rad);
  const auto found = std::find_if(prepared_.begin(), prepared_.end(), [&](const Prepared& p) {
    return p.id == id && p.yaw_steps == steps;
  });
  if (found == prepared_.end()) return nullptr;
  prepared_.splice(prepared_.begin(), prepared_, found);
  return found->submap;
}

std::shared_ptr<const RegistrationSubmap> PreparedSubmaps::Get(const Submap& submap,
                                                               double added_yaw_rad) {
  if (auto found = Find(submap.id, added_yaw_rad)) return found;
  const std::int32_t steps = YawSteps(added_yaw_rad);
  const auto prepared = std::make_shared<const RegistrationSubmap>(RegistrationSubmap::Prepare(
      submap.cloud, StraightFromBody(submap.T_map_submap, kYawStepRad * steps), params_));
  prepared_.push_front({submap.id, steps, prepared});
  bytes_ += prepared_.front().Bytes();
  while (bytes_ > max_bytes_) {
    bytes_ -= prepared_.back().Bytes();
    prepared_.pop_back();
  }
  return prepared;
}

}  // namespace seastitch
