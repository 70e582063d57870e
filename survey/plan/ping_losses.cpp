#include "survey/plan/ping_losses.hpp"

#include "common/geo/map_frame.hpp"

namespace seastitch {
namespace {

// A smaller share of lost pings is usual: before the first and after the last pose.
constexpr double kLeastShare = 0.99;

}  // namespace

PingLosses::PingLosses(std::int64_t pings, const PingTally& tally, std::int64_t too_far) {
  std::string reasons;
  std::int64_t lost = 0;
  for (PingLoss loss{}; loss < PingLoss::kCount; loss = Next(loss)) {
    if (tally[loss] == 0) continue;
    lost += tally[loss];
    reasons += (reasons.empty() ? ": " : "; ") + std::to_string(tally[loss]) + " because " +
               ReasonOf(loss);
  }
  if (too_far > 0)
    reasons += "; " + std::to_string(too_far) + " positions are more than " + LargestMapText() +
               " from the map origin";
  const std::int64_t used = pings - lost;
  is_warning = static_cast<double>(used) < kLeastShare * static_cast<double>(pings);
  text = std::to_string(used) + " of " + std::to_string(pings) + " pings used" +
         (is_warning ? reasons : "");
}

}  // namespace seastitch
