#include "mapper/submaps/losses.hpp"

#include <algorithm>
#include <cstdio>

namespace seastitch {
namespace {

struct Texts {
  const char* name;
  const char* reason;
};

Texts TextsOf(PingLoss loss) {
  switch (loss) {
    case PingLoss::kFromTheFuture:
      return {"pings_from_the_future", "their stamps are more than 30 s ahead of navigation"};
    case PingLoss::kOutOfOrder:
      return {"pings_out_of_order", "they came after a later ping was used"};
    case PingLoss::kWithoutPose:
      return {"pings_without_pose", "navigation has no pose at their times"};
    case PingLoss::kDroppedWaiting:
      return {"pings_dropped_waiting", "too many waited for navigation"};
    case PingLoss::kNotFinite: return {"pings_not_finite", "their poses are not finite"};
    case PingLoss::kBeforeNavigation:
      return {"pings_before_navigation", "they come before the first pose"};
    case PingLoss::kWithoutSoundings:
      return {"pings_without_soundings", "they have no sounding that can be used"};
    case PingLoss::kCount: break;
  }
  return {"", ""};
}

}  // namespace

const char* NameOf(PingLoss loss) { return TextsOf(loss).name; }
const char* ReasonOf(PingLoss loss) { return TextsOf(loss).reason; }

std::string Rejection::Text() const {
  char percent[32];
  std::snprintf(percent, sizeof percent, "%.1f %%", 100.0 * part);
  const std::string text = std::string(percent) + " of soundings rejected";
  return part > kUnusual ? text + ", most of them " + main_reason : text;
}

Rejection RejectionOf(std::int64_t valid_soundings, const Counters& rejected) {
  Rejection rejection;
  std::int64_t all = 0;
  std::int64_t most = 0;
  for (const auto& [name, count] : rejected) {
    all += count;
    if (count > most) rejection.main_reason = name;
    most = std::max(most, count);
  }
  if (valid_soundings > 0)
    rejection.part = static_cast<double>(all) / static_cast<double>(valid_soundings);
  return rejection;
}

}  // namespace seastitch
