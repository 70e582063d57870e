#include "mapper/health/ping_watch.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>

namespace seastitch {
namespace {

constexpr double kLookEveryS = 1.0;
constexpr double kOverS = 60.0;
// Fewer refused pings in a minute, or a smaller share of them, are no fault.
constexpr std::int64_t kMany = 5;
constexpr double kShare = 0.02;

constexpr std::array kReasons{
    PingRefusal{"pings_from_the_future", "their stamps are more than 30 s ahead of navigation"},
    PingRefusal{"pings_out_of_order", "they came after a later ping was used"},
    PingRefusal{"pings_without_pose", "navigation has no pose at their times"},
    PingRefusal{"pings_dropped_waiting", "too many waited for navigation"},
    PingRefusal{"pings_not_finite", "their poses are not finite"},
};

}  // namespace

std::span<const PingRefusal> PingRefusals() { return kReasons; }

bool PingWatch::IsDue(Time now) const {
  if (last_minute_.empty()) return true;
  const double since_s = ToSeconds(now - last_minute_.back().time);
  return since_s >= kLookEveryS || since_s < 0.0;
}

void PingWatch::Look(Time now, std::int64_t received, const Counts& refused) {
  Counted counted{now, received, {}};
  for (const PingRefusal& reason : kReasons) {
    const auto found = refused.find(reason.counter);
    counted.refused.push_back(found == refused.end() ? 0 : found->second);
  }
  last_minute_.push_back(std::move(counted));
  while (ToSeconds(now - last_minute_.front().time) > kOverS) last_minute_.pop_front();
}

std::vector<Condition> PingWatch::conditions() const {
  if (last_minute_.empty()) return {};
  const Counted& then = last_minute_.front();
  const Counted& now = last_minute_.back();
  std::int64_t all = 0;
  std::int64_t most = 0;
  std::size_t commonest = 0;
  for (std::size_t i = 0; i < kReasons.size(); ++i) {
    const std::int64_t refused = now.refused[i] - then.refused[i];
    all += refused;
    if (refused > most) commonest = i;
    most = std::max(most, refused);
  }
  // Some of those refused in this minute came in the one before.
  const auto received = static_cast<double>(std::max(all, now.received - then.received));
  if (all < kMany || static_cast<double>(all) < kShare * received) return {};
  char text[160];
  std::snprintf(text,
                sizeof text,
                "%.0f %% of the last minute, mostly because %s",
                100.0 * static_cast<double>(all) / received,
                kReasons[commonest].sentence);
  return {{&conditions::kPingsRefused, text}};
}

}  // namespace seastitch
