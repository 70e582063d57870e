#include "common/runtime/event_loop.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

namespace seastitch {
namespace {

int OpenSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // Writing to a closed connection returns an error of write() and does not end the process.
  std::signal(SIGPIPE, SIG_IGN);
  const int fd = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (fd < 0) throw std::runtime_error(std::string("signalfd: ") + std::strerror(errno));
  return fd;
}

int OpenTimer(std::chrono::milliseconds period) {
  const int fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
  if (fd < 0) throw std::runtime_error(std::string("timerfd: ") + std::strerror(errno));
  itimerspec spec{};
  spec.it_interval.tv_sec = period.count() / 1000;
  spec.it_interval.tv_nsec = period.count() % 1000 * 1'000'000;
  spec.it_value = spec.it_interval;
  timerfd_settime(fd, 0, &spec, nullptr);
  return fd;
}

}  // namespace

EventLoop::EventLoop() : signal_fd_(OpenSignals()) {
  Add(signal_fd_, [this] {
    signalfd_siginfo info{};
    if (read(signal_fd_, &info, sizeof info) == sizeof info) Stop();
  });
}

EventLoop::~EventLoop() {
  for (const int fd : timer_fds_) close(fd);
  close(signal_fd_);
}

void EventLoop::Add(int fd, std::function<void()> on_ready) {
  sources_.push_back({fd, std::move(on_ready)});
}

void EventLoop::Remove(int fd) {
  // Marked, not erased: the handler that removes the source may be running now.
  for (Source& source : sources_)
    if (source.fd == fd) source.removed = true;
}

void EventLoop::Every(std::chrono::milliseconds period, std::function<void()> fn) {
  const int fd = OpenTimer(period);
  timer_fds_.push_back(fd);
  Add(fd, [fd, fn = std::move(fn)] {
    std::uint64_t expirations = 0;
    // Periods missed while another handler ran cause one call, not several.
    if (read(fd, &expirations, sizeof expirations) == sizeof expirations) fn();
  });
}

int EventLoop::Run() {
  running_ = true;
  sd_notify(0, "READY=1");
  std::vector<pollfd> fds;
  std::vector<Source*> polled;
  while (running_) {
    sources_.remove_if([](const Source& source) { return source.removed; });
    fds.clear();
    polled.clear();
    for (Source& source : sources_) {
      fds.push_back({source.fd, POLLIN, 0});
      polled.push_back(&source);
    }
    if (poll(fds.data(), fds.size(), -1) < 0) {
      if (errno == EINTR) continue;
      spdlog::error("poll: {}", std::strerror(errno));
      return EXIT_FAILURE;
    }
    for (std::size_t i = 0; i < fds.size() && running_; ++i) {
      if (fds[i].revents == 0 || polled[i]->removed) continue;
      if ((fds[i].revents & POLLNVAL) != 0) {
        spdlog::error("descriptor {} was closed but not removed", fds[i].fd);
        polled[i]->removed = true;
        continue;
      }
      polled[i]->on_ready();
    }
  }
  sd_notify(0, "STOPPING=1");
  return EXIT_SUCCESS;
}

}  // namespace seastitch
