#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/time.hpp"
#include "mapper/submaps/losses.hpp"

namespace seastitch {

// Monitor for HEALTH of the pings that no submap gets: their share of the last minute, and the
// commonest reason. Pure; its time is that of navigation.
class PingWatch {
 public:
  // True if Look() is due, once a second.
  bool IsDue(Time now) const;
  // received, lost: all pings so far.
  void Look(Time now, std::int64_t received, const PingTally& lost);

  std::vector<Condition> conditions() const;

 private:
  struct Counted {
    Time time;
    std::int64_t received = 0;
    PingTally lost;
  };

  std::deque<Counted> last_minute_;  // oldest first
};

}  // namespace seastitch
