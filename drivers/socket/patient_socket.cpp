#include "drivers/socket/patient_socket.hpp"

#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace seastitch {
namespace {

void Watch(int poll_fd, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  if (epoll_ctl(poll_fd, EPOLL_CTL_ADD, fd, &event) != 0)
    throw std::runtime_error(std::string("epoll: ") + std::strerror(errno));
}

}  // namespace

PatientSocket::PatientSocket(std::string name, Open open, bool logs)
    : name_(std::move(name)),
      open_(std::move(open)),
      logs_(logs),
      poll_(epoll_create1(EPOLL_CLOEXEC)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {
  if (!poll_ || !timer_) throw std::runtime_error(name_ + ": " + std::strerror(errno));
  Watch(poll_.get(), timer_.get());
  if (!OpenNow()) Lose(trouble_);
}

bool PatientSocket::TryToOpen() {
  std::uint64_t expirations = 0;
  if (socket_ || read(timer_.get(), &expirations, sizeof expirations) < 0 || !OpenNow())
    return false;
  SetTimer(false);
  if (logs_) spdlog::info("{}: open", name_);
  return true;
}

void PatientSocket::Lose(const std::string& why) {
  trouble_ = why;
  socket_ = FileDescriptor();  // closing also removes it from the epoll
  SetTimer(true);
  if (logs_) spdlog::warn("{}: {}; trying again every second", name_, why);
}

bool PatientSocket::OpenNow() {
  try {
    FileDescriptor fd = open_();
    Watch(poll_.get(), fd.get());
    socket_ = std::move(fd);
    trouble_.clear();
  } catch (const NotYet& e) {
    trouble_ = e.what();
  }
  return is_open();
}

void PatientSocket::SetTimer(bool on) {
  itimerspec spec{};
  if (on) spec.it_value.tv_sec = spec.it_interval.tv_sec = 1;
  timerfd_settime(timer_.get(), 0, &spec, nullptr);
}

}  // namespace seastitch
