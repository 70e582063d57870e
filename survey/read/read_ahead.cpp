#include "survey/read/read_ahead.hpp"

#include <utility>

namespace seastitch {
namespace {

constexpr std::size_t kBatch = 64;
constexpr std::size_t kMostBatches = 4;

}  // namespace

ReadAhead::ReadAhead(SampleSource* source) : source_(source), thread_([this] { Run(); }) {}

ReadAhead::~ReadAhead() {
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ReadAhead::Run() {
  bool is_read = false;
  while (!is_read) {
    Batch batch;
    batch.items.reserve(kBatch);
    std::exception_ptr error;
    try {
      while (batch.items.size() < kBatch && !is_read) {
        if (std::optional<Received> sample = source_->Next())
          batch.items.push_back({*std::move(sample), source_->input()});
        else
          is_read = true;
      }
      batch.percent_read = source_->percent_read();
    } catch (...) {
      error = std::current_exception();
      is_read = true;
    }
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_stopped_ || ready_.size() < kMostBatches; });
    if (is_stopped_) return;
    ready_.push_back(std::move(batch));
    is_read_ = is_read;
    error_ = error;
    lock.unlock();
    changed_.notify_all();
  }
}

std::optional<ReadAhead::Item> ReadAhead::Next() {
  while (next_ == batch_.items.size()) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !ready_.empty() || is_read_; });
    if (ready_.empty()) {
      if (error_) std::rethrow_exception(error_);
      return std::nullopt;
    }
    batch_ = std::move(ready_.front());
    ready_.pop_front();
    next_ = 0;
    lock.unlock();
    changed_.notify_all();
  }
  return std::move(batch_.items[next_++]);
}

}  // namespace seastitch
