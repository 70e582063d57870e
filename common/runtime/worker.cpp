#include "common/runtime/worker.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>

namespace seastitch {
namespace {

int OpenEvent() {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) throw std::runtime_error(std::string("eventfd: ") + std::strerror(errno));
  return fd;
}

// Runs a job. Its exception is thrown again on the loop thread, where main() reports it.
std::function<void()> RunJob(const Worker::Job& job) {
  try {
    return job();
  } catch (...) {
    return [error = std::current_exception()] { std::rethrow_exception(error); };
  }
}

}  // namespace

ThreadWorker::ThreadWorker(std::size_t max_queue)
    : max_queue_(max_queue), fd_(OpenEvent()), thread_([this] { Main(); }) {}

ThreadWorker::~ThreadWorker() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_worker_.notify_all();
  thread_.join();
  close(fd_);
}

bool ThreadWorker::Post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() >= max_queue_) return false;
    jobs_.push_back(std::move(job));
  }
  wake_worker_.notify_one();
  return true;
}

std::size_t ThreadWorker::queue_depth() const {
  const std::lock_guard lock(mutex_);
  return jobs_.size() + (busy_ ? 1 : 0);
}

void ThreadWorker::ReportProgress() {
  const std::lock_guard lock(mutex_);
  sign_of_life_ = std::chrono::steady_clock::now();
}

double ThreadWorker::age_s() const {
  const std::lock_guard lock(mutex_);
  if (!busy_) return 0.0;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - sign_of_life_).count();
}

void ThreadWorker::Drain() {
  std::uint64_t finished = 0;
  // Resets the descriptor. What is done is in done_, with or without a signal.
  [[maybe_unused]] const ssize_t n = read(fd_, &finished, sizeof finished);
  std::deque<std::function<void()>> done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  for (const auto& quick_part : done)
    if (quick_part) quick_part();
}

void ThreadWorker::Finish() {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      wake_finish_.wait(lock, [this] { return !done_.empty() || (jobs_.empty() && !busy_); });
      if (done_.empty()) return;
    }
    Drain();  // may post more
  }
}

void ThreadWorker::Main() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_worker_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (stop_) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    busy_ = true;
    sign_of_life_ = std::chrono::steady_clock::now();
    lock.unlock();
    std::function<void()> quick_part = RunJob(job);
    job = nullptr;  // frees the job's memory before the loop gets its result
    lock.lock();
    busy_ = false;
    done_.push_back(std::move(quick_part));
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t n = write(fd_, &one, sizeof one);
    wake_finish_.notify_all();
  }
}

}  // namespace seastitch
