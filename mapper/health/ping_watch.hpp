#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/core/conditions.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// A reason for which no submap gets a ping, by the name of its counter.
struct PingRefusal {
  const char* counter;
  const char* sentence;
};
std::span<const PingRefusal> PingRefusals();

// Monitor for HEALTH of the pings that no submap gets: their share of the last minute, and the
// commonest reason. Pure; its time is that of navigation.
class PingWatch {
 public:
  // Pings so far, by the names of their counters.
  using Counts = std::map<std::string, std::int64_t>;

  // True if Look() is due, once a second.
  bool IsDue(Time now) const;
  // received: all pings so far. refused: those refused, by reason; names of other counters are
  // ignored.
  void Look(Time now, std::int64_t received, const Counts& refused);

  std::vector<Condition> conditions() const;

 private:
  struct Counted {
    Time time;
    std::int64_t received = 0;
    std::vector<std::int64_t> refused;  // by reason
  };

  std::deque<Counted> last_minute_;  // oldest first
};

}  // namespace seastitch
