#pragma once

#include <cstddef>
#include <list>
#include <memory>

#include "common/core/ids.hpp"
#include "common/core/submap.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// Cache of submaps prepared for registration, so that a submap that is registered with several
// others is prepared once. Not thread-safe.
class PreparedSubmaps {
 public:
  // max_bytes: limit of the cache; the default holds about twenty submaps of 50,000 points.
  explicit PreparedSubmaps(const RegistrationParams& params, std::size_t max_bytes = 32'000'000)
      : params_(params), max_bytes_(max_bytes) {}

  // Prepares a submap, straightened by added_yaw_rad (StraightFromBody()), or returns it from the
  // cache: a submap's points never change.
  std::shared_ptr<const RegistrationSubmap> Get(const Submap& submap, double added_yaw_rad = 0.0);
  // Null if it is not in the cache.
  std::shared_ptr<const RegistrationSubmap> Find(SubmapId id, double added_yaw_rad = 0.0);

 private:
  struct Prepared {
    SubmapId id;
    std::int32_t yaw_steps;  // by which it is straightened
    std::shared_ptr<const RegistrationSubmap> submap;

    std::size_t Bytes() const;
  };

  const RegistrationParams params_;
  const std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::list<Prepared> prepared_;  // used last first
};

}  // namespace seastitch
