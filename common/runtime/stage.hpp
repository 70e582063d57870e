#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace seastitch {

// A thread that takes items one after another, in the order in which they are added. So work that
// only consumes goes on beside what makes it, and the results stay the same.
template <class T>
class Stage {
 public:
  // most: items that may wait.
  Stage(std::function<void(T)> take, std::size_t most)
      : take_(std::move(take)), most_(most), thread_([this] { Run(); }) {}
  // Takes what waits.
  ~Stage() {
    {
      const std::lock_guard lock(mutex_);
      is_ended_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  // Waits where too many items wait. Throws what an earlier item's take threw.
  void Add(T item) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.size() < most_ || error_; });
    if (error_) std::rethrow_exception(error_);
    waiting_.push_back(std::move(item));
    lock.unlock();
    changed_.notify_all();
  }
  // Waits until all items are taken. Throws what a take threw.
  void Finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return (waiting_.empty() && !is_taking_) || error_; });
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void Run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return is_ended_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      T item = std::move(waiting_.front());
      waiting_.pop_front();
      is_taking_ = true;
      lock.unlock();
      std::exception_ptr error;
      try {
        take_(std::move(item));
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      is_taking_ = false;
      if (error) error_ = error;
      changed_.notify_all();
      if (error) return;
    }
  }

  const std::function<void(T)> take_;
  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> waiting_;
  bool is_taking_ = false;
  bool is_ended_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace seastitch
