#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace seastitch {

// Runs long computations in the background of an event loop.
//
// A job is a function that computes on the worker. It owns its data and uses no member of the
// object that posted it. It returns a completion function (or an empty one), which then runs on the
// thread of the event loop and may use such members. So no mutex is needed.
class Worker {
 public:
  using Job = std::function<std::function<void()>()>;
  virtual ~Worker() = default;
  // Queues a job. False: the queue is full, and the job is dropped; the caller has to count it.
  virtual bool Post(Job job) = 0;
  // Number of jobs that wait or run.
  virtual std::size_t queue_depth() const = 0;
  // Heartbeat, to be called by a job that takes longer than a second.
  virtual void ReportProgress() {}
};

// Runs job and completion function inside Post(). For replay, so that the result does not depend on
// the speed of the machine.
class InlineWorker : public Worker {
 public:
  bool Post(Job job) override {
    job()();
    return true;
  }
  std::size_t queue_depth() const override { return 0; }
};

// One background thread with a bounded queue. Add fd() to the event loop with Drain() as its
// handler.
class ThreadWorker : public Worker {
 public:
  explicit ThreadWorker(std::size_t max_queue);
  // Waits for the running job. Drops waiting jobs, and completion functions that have not run.
  ~ThreadWorker() override;
  ThreadWorker(const ThreadWorker&) = delete;
  ThreadWorker& operator=(const ThreadWorker&) = delete;

  bool Post(Job job) override;
  std::size_t queue_depth() const override;
  void ReportProgress() override;
  // Seconds since the running job began or last reported progress; 0 where none runs. The time that
  // other jobs wait behind it does not count.
  double age_s() const;
  // Event descriptor, readable when a completion function is ready. Closed by the destructor.
  int fd() const { return fd_; }
  // Runs the completion functions of finished jobs. On the thread of the event loop.
  void Drain();
  // Waits until all posted jobs are done, and runs their completion functions. On the thread of the
  // event loop.
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
