#include "mapper/health/ping_watch.hpp"

#include <algorithm>
#include <cstdio>

namespace seastitch {
namespace {

constexpr double kLookEveryS = 1.0;
constexpr double kOverS = 60.0;
// Fewer refused pings in a minute, or a smaller share of them, are no fault.
constexpr std::int64_t kMany = 5;
constexpr double kShare = 0.02;

}  // namespace

bool PingWatch::IsDue(Time now) const {
  if (last_minute_.empty()) return true;
  const double since_s = ToSeconds(now - last_minute_.back().time);
  return since_s >= kLookEveryS || since_s < 0.0;
}

void PingWatch::Look(Time now, std::int64_t received, const PingTally& lost) {
  last_minute_.push_back({now, received, lost});
  while (ToSeconds(now - last_minute_.front().time) > kOverS) last_minute_.pop_front();
}

std::vector<Condition> PingWatch::conditions() const {
  if (last_minute_.empty()) return {};
  const Counted& then = last_minute_.front();
  const Counted& now = last_minute_.back();
  std::int64_t all = 0;
  std::int64_t most = 0;
  PingLoss commonest{};
  for (PingLoss loss{}; IsFault(loss); loss = Next(loss)) {
    const std::int64_t lost = now.lost[loss] - then.lost[loss];
    all += lost;
    if (lost > most) commonest = loss;
    most = std::max(most, lost);
  }
  // Some of those refused in this minute came in the one before.
  const auto received = static_cast<double>(std::max(all, now.received - then.received));
  if (all < kMany || static_cast<double>(all) < kShare * received) return {};
  char text[160];
  std::snprintf(text,
                sizeof text,
                "%.0f %% of the last minute, mostly because %s",
                100.0 * static_cast<double>(all) / received,
                ReasonOf(commonest));
  return {{&conditions::kPingsRefused, text}};
}

}  // namespace seastitch
