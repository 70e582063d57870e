#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "common/core/for_each.hpp"
#include "common/runtime/stage.hpp"

namespace seastitch {

// A JobQueue whose jobs run on a thread of its own.
class JobsBeside : public JobQueue {
 public:
  JobsBeside() : stage_(RunAll, kMostWaiting) {}

  void Add(std::function<void()> job) override {
    batch_.push_back(std::move(job));
    if (batch_.size() == kBatch) Send();
  }
  void Finish() override {
    if (!batch_.empty()) Send();
    stage_.Finish();
  }

 private:
  // Jobs pass in batches: a lock for each would cost as much as a short job.
  using Batch = std::vector<std::function<void()>>;
  static constexpr std::size_t kBatch = 32;
  static constexpr std::size_t kMostWaiting = 4;

  static void RunAll(const Batch& batch) {
    for (const std::function<void()>& job : batch) job();
  }
  void Send() { stage_.Add(std::exchange(batch_, {})); }

  Batch batch_;
  Stage<Batch> stage_;
};

}  // namespace seastitch
