#pragma once

#include <chrono>
#include <csignal>
#include <functional>
#include <list>
#include <vector>

namespace seastitch {

// Event loop: one thread, one poll(). SIGINT and SIGTERM arrive on a descriptor, so that no code
// runs in a signal handler. Construct it before anything that starts a thread, because it blocks
// the signals for all threads.
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  void Add(int fd, std::function<void()> on_ready);
  void Remove(int fd);
  // Calls fn at every period of the machine's monotonic clock. For HEALTH, watchdogs and
  // reconnection; never for anything that changes the map.
  void Every(std::chrono::milliseconds period, std::function<void()> fn);

  // Runs until a signal or Stop() from a handler; may run again. EXIT_SUCCESS, or EXIT_FAILURE when
  // poll() itself fails.
  int Run();
  void Stop() { running_ = false; }

 private:
  struct Source {
    int fd;
    std::function<void()> on_ready;
    bool removed = false;
  };

  std::list<Source> sources_;
  std::vector<int> timer_fds_;
  int signal_fd_ = -1;
  bool running_ = false;
};

}  // namespace seastitch
