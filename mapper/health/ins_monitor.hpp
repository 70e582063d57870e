#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/fault_events.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/navigation.hpp"

namespace seastitch {

// Monitor of an INS whose poses are used (navigation_source: given) for HEALTH: a fault in its own
// status, silence, a missing value that a map needs, jumps of its position. Pure; its time is that
// of the samples.
class InsMonitor {
 public:
  void Add(const NavigationSample& sample);
  // Takes the time of a ping: while pings come, a silent INS is a fault.
  void See(Time ping) { newest_ = newest_ ? std::max(*newest_, ping) : ping; }
  // Call it after navigation has taken a sample.
  void Look(const Navigation& navigation);

  std::vector<Condition> conditions(const Navigation& navigation) const;

 private:
  std::optional<std::string> WhyNotUsable() const;

  std::optional<Time> first_;
  std::optional<Time> newest_;                        // of the newest sample of INS or sonar
  std::optional<Time> sample_, position_, attitude_;  // times of the newest ones
  std::optional<Time> bad_since_;                     // bad by the INS's own status
  InsStatus status_ = InsStatus::kUnknown;
  FaultEvents<Time> jumps_{conditions::kInsJumps};
};

}  // namespace seastitch
