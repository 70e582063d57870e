#pragma once

#include <future>
#include <optional>
#include <utility>

#include "common/core/time.hpp"

namespace seastitch {

// A computation on a thread of its own, beside the samples that follow. Its result is taken some
// seconds of the dive later, as at sea, or when its owner needs it. So what comes out does not
// depend on how long the computation takes.
template <class Result>
class ComputationBeside {
 public:
  // Time of the dive after which the result is taken [s].
  explicit ComputationBeside(double due_after_s) : due_after_s_(due_after_s) {}

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
    return !now || !since_ || *now < *since_ || ToSeconds(*now - *since_) >= due_after_s_;
  }
  // Waits for the result; rethrows what the computation threw. Requires IsRunning().
  Result Take() { return result_.get(); }

 private:
  const double due_after_s_;
  std::optional<Time> since_;
  std::future<Result> result_;  // its destructor waits for the thread
};

}  // namespace seastitch
