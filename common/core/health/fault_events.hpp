#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/core/health/condition_kind.hpp"
#include "common/core/time.hpp"

namespace seastitch {

inline double SecondsBetween(double from_s, double to_s) { return to_s - from_s; }
inline double SecondsBetween(Time from, Time to) { return ToSeconds(to - from); }

// The events of a fault that is no state, such as dropped datagrams, and whether they are a fault
// by the rule of its kind. Stamp: instants of any one clock, in seconds (double) or as Time.
template <class Stamp>
class FaultEvents {
 public:
  explicit FaultEvents(const ConditionKind& kind) : rule_(kind.events) {}

  // Adds one event.
  void Add(Stamp now) { Follow(total_ + 1, now); }
  // Adds the events by which their number grew since the last call.
  void Follow(std::int64_t total, Stamp now) {
    const std::size_t fewest = static_cast<std::size_t>(rule_.fewest);
    for (std::size_t i = 0; total_ < total && i < fewest; ++total_, ++i) last_.push_back(now);
    total_ = total;
    while (last_.size() > fewest) last_.pop_front();
  }

  // A time from before the events, by a clock that went back, ends the fault like a later one.
  bool Holds(Stamp now) const {
    return last_.size() == static_cast<std::size_t>(rule_.fewest) &&
           std::abs(SecondsBetween(last_.back(), now)) < rule_.holds_s &&
           std::abs(SecondsBetween(last_.front(), now)) < rule_.within_s;
  }
  std::int64_t total() const { return total_; }
  // The last event; absent without one.
  std::optional<Stamp> last() const {
    return last_.empty() ? std::nullopt : std::optional(last_.back());
  }

 private:
  EventRule rule_;
  std::int64_t total_ = 0;
  std::deque<Stamp> last_;  // oldest first, at most rule_.fewest
};

}  // namespace seastitch
