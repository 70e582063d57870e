#include "mapper/registration/prepared_submaps.hpp"

#include <algorithm>

namespace seastitch {
namespace {

std::size_t BytesOf(const RegistrationSubmap& submap) {
  std::size_t cells = 0;
  for (const RegistrationSubmap::Level& level : submap.levels())
    cells += level.grid.geometry().size();
  return cells * sizeof(RegistrationSubmap::Cell);
}

}  // namespace

std::shared_ptr<const RegistrationSubmap> PreparedSubmaps::Get(const Submap& submap) {
  const auto found = std::find_if(
      prepared_.begin(), prepared_.end(), [&](const Prepared& p) { return p.id == submap.id; });
  if (found != prepared_.end()) {
    prepared_.splice(prepared_.begin(), prepared_, found);
    return found->submap;
  }
  const auto prepared = std::make_shared<const RegistrationSubmap>(
      RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params_));
  prepared_.push_front({submap.id, prepared});
  bytes_ += BytesOf(*prepared);
  while (bytes_ > max_bytes_) {
    bytes_ -= BytesOf(*prepared_.back().submap);
    prepared_.pop_back();
  }
  return prepared;
}

}  // namespace seastitch
