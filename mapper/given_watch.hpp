#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/core/conditions.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"

namespace seastitch {

// What is wrong with an INS whose navigation is taken as given, for HEALTH: it says so itself, it
// is silent, it leaves out what a map needs, its position jumps. Pure; its time is that of the
// samples.
class GivenWatch {
 public:
  void Add(const NavigationSample& sample);
  // That the sonar is at work: an INS that is silent then is missed.
  void See(Time ping) { newest_ = newest_ ? std::max(*newest_, ping) : ping; }
  // After navigation has taken a sample.
  void Look(const Navigation& navigation);

  std::vector<Condition> conditions(const Navigation& navigation) const;

 private:
  std::optional<std::string> WhyNotUsable() const;

  std::optional<Time> first_;
  std::optional<Time> newest_;                        // of the INS or the sonar
  std::optional<Time> sample_, position_, attitude_;  // the newest
  std::optional<Time> bad_since_;                     // by its own status
  InsStatus status_ = InsStatus::kUnknown;
  std::int64_t jumps_ = 0;
  std::deque<Time> jumped_;  // in the last minute
};

}  // namespace seastitch
