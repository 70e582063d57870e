#include "mapper/health/ins_monitor.hpp"

#include <cstdio>
#include <string>

namespace seastitch {
namespace {

// InsNavigation uses the last position and attitude for no longer than this.
constexpr double kSilentS = 2.0;
constexpr double kStartS = 10.0;

std::string Since(const char* what, double seconds) {
  char text[100];
  std::snprintf(text, sizeof text, "%s for %.0f s", what, seconds);
  return text;
}

bool IsBad(InsStatus status) {
  return status == InsStatus::kInvalid || status == InsStatus::kAligning;
}

}  // namespace

void InsMonitor::Add(const NavigationSample& sample) {
  if (!first_) first_ = sample.time;
  See(sample.time);
  sample_ = sample.time;
  status_ = sample.status;
  if (IsBad(status_)) {
    if (!bad_since_) bad_since_ = sample.time;
    return;
  }
  bad_since_.reset();
  if (sample.position) position_ = sample.time;
  if (sample.attitude) attitude_ = sample.time;
}

void InsMonitor::Look(const Navigation& navigation) {
  if (newest_) jumps_.Follow(navigation.tally().jumps(), *newest_);
}

std::optional<std::string> InsMonitor::WhyNotUsable() const {
  const auto silent_s = [this](std::optional<Time> last) {
    return ToSeconds(*newest_ - last.value_or(*first_));
  };
  if (bad_since_)
    return Since(status_ == InsStatus::kAligning ? "it says that it is aligning"
                                                 : "it says that it is not valid",
                 ToSeconds(*sample_ - *bad_since_));
  if (silent_s(sample_) > kSilentS) return Since("silent", silent_s(sample_));
  if (silent_s(position_) > kSilentS) return Since("no position", silent_s(position_));
  if (silent_s(attitude_) > kSilentS) return Since("no attitude", silent_s(attitude_));
  return std::nullopt;
}

std::vector<Condition> InsMonitor::conditions(const Navigation& navigation) const {
  std::vector<Condition> now;
  if (!newest_) return now;
  if (!first_) {
    now.push_back({&conditions::kInsNotUsable, "no message of it yet, while the sonar pings"});
    return now;
  }
  if (const auto why = WhyNotUsable()) now.push_back({&conditions::kInsNotUsable, *why});
  if (!navigation.latest() && ToSeconds(*newest_ - *first_) > kStartS)
    now.push_back({&conditions::kNavigationNotStarted, Explain(navigation.start_state())});
  if (jumps_.Holds(*newest_))
    now.push_back({&conditions::kInsJumps, std::to_string(jumps_.total()) + " in all"});
  return now;
}

}  // namespace seastitch
