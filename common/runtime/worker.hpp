#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace seastitch {

// Runs slow pure work beside the loop. A job owns its data and touches no member of its node; it
// returns the quick part, which runs on the loop thread: the node needs no mutex.
class Worker {
 public:
  using Job = std::function<std::function<void()>()>;
  virtual ~Worker() = default;
  // False when the queue is full: the caller counts the refusal.
  virtual bool Post(Job job) = 0;
  virtual std::size_t queue_depth() const = 0;
  // A sign of life from inside a job that takes long.
  virtual void ReportProgress() {}
};

// At once, on the caller's thread: in replay, so that the result cannot depend on the machine.
class InlineWorker : public Worker {
 public:
  bool Post(Job job) override {
    job()();
    return true;
  }
  std::size_t queue_depth() const override { return 0; }
};

// One thread, a bounded queue. Add fd() to the event loop with Drain() as its handler.
class ThreadWorker : public Worker {
 public:
  explicit ThreadWorker(std::size_t max_queue);
  ~ThreadWorker() override;  // waits for the job that runs; drops those that wait
  ThreadWorker(const ThreadWorker&) = delete;
  ThreadWorker& operator=(const ThreadWorker&) = delete;

  bool Post(Job job) override;
  std::size_t queue_depth() const override;
  void ReportProgress() override;
  // Seconds since the job that runs began or last reported progress; 0 where none runs. What waits
  // behind a job that makes progress is not late.
  double age_s() const;
  int fd() const { return fd_; }
  // Runs the quick parts of finished jobs.
  void Drain();
  // Waits until every posted job is done and its quick part has run.
  void Finish();

 private:
  void Main();

  const std::size_t max_queue_;
  const int fd_;
  mutable std::mutex mutex_;
  std::condition_variable wake_worker_;
  std::condition_variable wake_finish_;
  bool stop_ = false;
  bool busy_ = false;
  std::chrono::steady_clock::time_point sign_of_life_;  // of the job that runs
  std::deque<Job> jobs_;
  std::deque<std::function<void()>> done_;
  std::thread thread_;
};

}  // namespace seastitch
