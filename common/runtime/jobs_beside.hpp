#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "common/core/for_each.hpp"
#include "common/runtime/stage.hpp"

namespace seastitch {

// A JobQueue whose jobs run on a thread of its own.
class JobsBeside : public JobQueue {
 public:
  // before: a job that was added to that queue before one of this queue runs before it, too, and
  // Finish() waits for both. It must outlive this queue. Null: none.
  explicit JobsBeside(JobsBeside* before = nullptr)
      : before_(before), stage_([this](const Batch& batch) { Run(batch); }, kMostWaiting) {}

  void Add(std::function<void()> job) override {
    jobs_.push_back(std::move(job));
    if (jobs_.size() == kBatch) Send();
  }
  void Finish() override {
    if (before_ != nullptr) before_->Finish();
    Send();
    stage_.Finish();
  }

 private:
  // Jobs pass in batches: a lock for each would cost as much as a short job.
  struct Batch {
    std::vector<std::function<void()>> jobs;
    std::size_t after = 0;  // so many batches of the queue before
  };
  static constexpr std::size_t kBatch = 32;
  static constexpr std::size_t kMostWaiting = 4;
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  // Returns how many batches are sent.
  std::size_t Send() {
    if (jobs_.empty()) return sent_;
    const std::size_t after = before_ == nullptr ? 0 : before_->Send();
    stage_.Add({std::exchange(jobs_, {}), after});
    return ++sent_;
  }

  void Run(const Batch& batch) {
    if (before_ != nullptr) before_->WaitUntilRun(batch.after);
    try {
      for (const std::function<void()>& job : batch.jobs) job();
    } catch (...) {
      // None will run after this.
      run_ = kAll;
      run_.notify_all();
      throw;
    }
    ++run_;
    run_.notify_all();
  }

  void WaitUntilRun(std::size_t batches) const {
    for (std::size_t run = run_; run < batches; run = run_) run_.wait(run);
  }

  JobsBeside* const before_;
  std::vector<std::function<void()>> jobs_;
  std::size_t sent_ = 0;              // batches
  std::atomic<std::size_t> run_ = 0;  // batches; kAll after a job that threw
  Stage<Batch> stage_;
};

}  // namespace seastitch
