#pragma once

#include <future>
#include <optional>
#include <utility>

#include "common/core/time.hpp"

namespace seastitch {

// Time of the dive after which the result of a ComputationBeside is taken [s].
inline constexpr double kTakenAfterS = 8.0;

// A computation on a thread of its own, beside the samples that follow. Its result is taken
// kTakenAfterS of the dive later, or when its owner needs it: never because it is ready. So what
// comes out does not depend on how long the computation takes.
template <class Result>
class ComputationBeside {
 public:
  // now: time of the newest navigation; the result is due at once where there is none.
  // Requires !IsRunning().
  template <class Compute>
  void Start(std::optional<Time> now, Compute compute) {
    since_ = now;
    result_ = std::async(std::launch::async, std::move(compute));
  }
  bool IsRunning() const { return result_.valid(); }
  // A clock that steps back makes the result due.
  bool IsDue(std::optional<Time> now) const {
    return !now || !since_ || *now < *since_ || ToSeconds(*now - *since_) >= kTakenAfterS;
  }
  // Waits for the result; rethrows what the computation threw. Requires IsRunning().
  Result Take() { return result_.get(); }

 private:
  std::optional<Time> since_;
  std::future<Result> result_;  // its destructor waits for the thread
};

}  // namespace seastitch
