#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "common/runtime/event_loop.hpp"

namespace seastitch {

// Handles Ctrl-C (and SIGTERM) in a long step. The first asks it to end with the results so far;
// the second ends the process at once, with kExitCode. Construct it before any thread is started.
class Interruption {
 public:
  static constexpr int kExitCode = 130;  // as a shell gives for SIGINT

  // clean_up: called before the process ends at once.
  explicit Interruption(std::function<void()> clean_up);
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const { return requested_; }

 private:
  void Main();

  const std::function<void()> clean_up_;
  std::atomic<bool> requested_ = false;
  std::atomic<bool> over_ = false;
  EventLoop loop_;
  std::thread thread_;
};

}  // namespace seastitch
