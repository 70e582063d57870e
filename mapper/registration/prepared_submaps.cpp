#include "mapper/registration/prepared_submaps.hpp"

#include <algorithm>

namespace seastitch {

std::size_t PreparedSubmaps::Prepared::Bytes() const {
  std::size_t bytes = sizeof(Prepared) + sizeof(RegistrationSubmap);
  for (const RegistrationSubmap::Level& level : submap->levels())
    bytes += level.grid.geometry().size() * sizeof(RegistrationSubmap::Cell);
  return bytes;
}

std::shared_ptr<const RegistrationSubmap> PreparedSubmaps::Find(SubmapId id) {
  const auto found = std::find_if(
      prepared_.begin(), prepared_.end(), [&](const Prepared& p) { return p.id == id; });
  if (found == prepared_.end()) return nullptr;
  prepared_.splice(prepared_.begin(), prepared_, found);
  return found->submap;
}

std::shared_ptr<const RegistrationSubmap> PreparedSubmaps::Get(const Submap& submap) {
  if (auto found = Find(submap.id)) return found;
  const auto prepared = std::make_shared<const RegistrationSubmap>(
      RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params_));
  prepared_.push_front({submap.id, prepared});
  bytes_ += prepared_.front().Bytes();
  while (bytes_ > max_bytes_) {
    bytes_ -= prepared_.back().Bytes();
    prepared_.pop_back();
  }
  return prepared;
}

}  // namespace seastitch
