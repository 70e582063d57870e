#include "survey/plan/ping_losses.hpp"

#include "mapper/health/ping_watch.hpp"

namespace seastitch {
namespace {

// Smaller shares of lost pings are normal: before the first and after the last pose.
constexpr double kLeastShare = 0.9;

std::int64_t ValueOr0(const Counters& counters, const std::string& name) {
  const auto found = counters.find(name);
  return found == counters.end() ? 0 : found->second;
}

}  // namespace

PingLosses::PingLosses(std::int64_t pings, const Counters& mapper) {
  std::string reasons;
  std::int64_t lost = 0;
  const auto add = [&](const char* counter, const char* sentence) {
    const std::int64_t count = ValueOr0(mapper, counter);
    if (count == 0) return;
    lost += count;
    reasons += (reasons.empty() ? ": " : "; ") + std::to_string(count) + " because " + sentence;
  };
  for (const PingRefusal& refusal : PingRefusals()) add(refusal.counter, refusal.sentence);
  add("pings_before_navigation", "they come before the first pose");
  add("pings_without_soundings", "they have no sounding that can be used");
  if (const std::int64_t far = ValueOr0(mapper, "nav_ins_position_far_from_datum"); far > 0)
    reasons += "; " + std::to_string(far) + " positions are more than 200 km from the map origin";
  const std::int64_t used = pings - lost;
  is_warning = static_cast<double>(used) < kLeastShare * static_cast<double>(pings);
  text = std::string(is_warning ? "warning: " : "") + std::to_string(used) + " of " +
         std::to_string(pings) + " pings used" + (is_warning ? reasons : "") + "\n";
}

}  // namespace seastitch
