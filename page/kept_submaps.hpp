#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "common/core/submap.hpp"

namespace seastitch {

// The submaps that the mapper keeps in the folder of the newest dive: a page that starts late, or
// whose messages were lost, has them from there.
class KeptSubmaps {
 public:
  // dives_dir: as in mapper.yaml; empty: none.
  explicit KeptSubmaps(std::filesystem::path dives_dir) : dives_dir_(std::move(dives_dir)) {}

  // Looks which dive and map are the newest; those of another begin anew. Call it now and then.
  void LookForNewest();
  // Gives all of them again, because the map of the page was begun anew.
  void BeginAnew() { read_ = 0; }
  // The next submap that was not given yet, with its points; absent: none for now. A damaged one is
  // left out and counted.
  std::optional<Submap> Next();
  std::int64_t damaged() const { return damaged_; }

 private:
  const std::filesystem::path dives_dir_;
  std::filesystem::path index_;  // of the newest map; empty: none
  std::uintmax_t read_ = 0;      // bytes of the index
  std::int64_t damaged_ = 0;
};

}  // namespace seastitch
