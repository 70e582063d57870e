#pragma once

#include <cstddef>
#include <list>
#include <memory>

#include "common/core/ids.hpp"
#include "common/core/submap.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// The submaps that were prepared for registration last, so that one that meets several others is
// prepared once. Not thread-safe.
class PreparedSubmaps {
 public:
  // max_bytes: of what is kept; twenty submaps of 50,000 points.
  explicit PreparedSubmaps(const RegistrationParams& params, std::size_t max_bytes = 32'000'000)
      : params_(params), max_bytes_(max_bytes) {}

  // A submap's points never change: what its id was prepared from is not looked at again.
  std::shared_ptr<const RegistrationSubmap> Get(const Submap& submap);
  // Null where it is not kept.
  std::shared_ptr<const RegistrationSubmap> Find(SubmapId id);

 private:
  struct Prepared {
    SubmapId id;
    std::shared_ptr<const RegistrationSubmap> submap;

    std::size_t Bytes() const;
  };

  const RegistrationParams params_;
  const std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::list<Prepared> prepared_;  // used last first
};

}  // namespace seastitch
