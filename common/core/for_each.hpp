#pragma once

#include <cstddef>
#include <functional>

namespace seastitch {

// A function that calls work(0) to work(n - 1), in any order and on any threads; the calls must not
// depend on each other. A pure function takes it as a parameter, so that its caller decides about
// threads.
using ForEach = std::function<void(std::size_t n, const std::function<void(std::size_t)>& work)>;

// One after another.
inline void ForEachInTurn(std::size_t n, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < n; ++i) work(i);
}

// Takes jobs, which run one after another in the order in which they were added, perhaps beside the
// caller. Like a ForEach it leaves it to the caller of pure code to decide about threads.
class JobQueue {
 public:
  virtual ~JobQueue() = default;
  // Throws what a job threw.
  virtual void Add(std::function<void()> job) = 0;
  // Waits until all have run. Throws what a job threw.
  virtual void Finish() = 0;
};

// Runs each job as it is added. One queue serves all callers, because it holds nothing.
inline JobQueue* JobsInTurn() {
  struct InTurn : JobQueue {
    void Add(std::function<void()> job) override { job(); }
    void Finish() override {}
  };
  static InTurn in_turn;
  return &in_turn;
}

}  // namespace seastitch
