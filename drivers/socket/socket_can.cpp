#include "drivers/socket/socket_can.hpp"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "drivers/socket/receive.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxFramesPerCall = 256;  // the loop has other things to do, too

std::runtime_error Problem(const std::string& interface, const std::string& reason) {
  return std::runtime_error("can:" + interface + ": " + reason);
}

void Watch(int poll_fd, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  if (epoll_ctl(poll_fd, EPOLL_CTL_ADD, fd, &event) != 0)
    throw std::runtime_error(std::string("epoll: ") + std::strerror(errno));
}

void SetRetryTimer(int fd, bool on) {
  itimerspec spec{};
  if (on) spec.it_value.tv_sec = spec.it_interval.tv_sec = 1;
  timerfd_settime(fd, 0, &spec, nullptr);
}

std::vector<can_filter> KernelFilters(const std::vector<CanFilter>& filters) {
  std::vector<can_filter> kernel;
  for (const CanFilter& filter : filters)
    kernel.push_back(
        {filter.id | (filter.extended ? CAN_EFF_FLAG : 0U),
         (filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK) | CAN_EFF_FLAG | CAN_RTR_FLAG});
  return kernel;
}

// Nothing where the kernel's structure makes no sense.
std::optional<CanFrame> ToFrame(Bytes raw) {
  if (raw.size() != CAN_MTU && raw.size() != CANFD_MTU) return std::nullopt;
  canfd_frame in{};
  std::memcpy(&in, raw.data(), raw.size());
  CanFrame frame;
  SetIdWord(in.can_id, &frame);
  frame.fd = raw.size() == CANFD_MTU;
  if (in.len > (frame.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN)) return std::nullopt;
  if (frame.fd) frame.fd_flags = in.flags & (CANFD_BRS | CANFD_ESI);
  frame.SetData(Bytes(in.data, in.len));
  return frame;
}

}  // namespace

SocketCanSource::SocketCanSource(const std::string& interface,
                                 const std::vector<CanFilter>& filters,
                                 int receive_buffer_bytes)
    : interface_(interface),
      filters_(filters),
      wanted_buffer_bytes_(receive_buffer_bytes),
      poll_(epoll_create1(EPOLL_CLOEXEC)),
      retry_timer_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {
  if (!poll_ || !retry_timer_) throw Problem(interface_, std::strerror(errno));
  Watch(poll_.get(), retry_timer_.get());
  Open();
}

void SocketCanSource::Open() {
  FileDescriptor fd(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (!fd)
    throw Problem(interface_, std::string("this kernel has no CAN: ") + std::strerror(errno));
  const unsigned index = if_nametoindex(interface_.c_str());
  if (index == 0) throw Problem(interface_, "no such interface");
  // Before bind(), so that nothing that is not wanted ever waits in the buffer.
  const std::vector<can_filter> filters = KernelFilters(filters_);
  setsockopt(fd.get(),
             SOL_CAN_RAW,
             CAN_RAW_FILTER,
             filters.data(),
             static_cast<socklen_t>(filters.size() * sizeof(can_filter)));
  const can_err_mask_t every_error = CAN_ERR_MASK;
  setsockopt(fd.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &every_error, sizeof every_error);
  const int on = 1;
  setsockopt(fd.get(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  counters_["can_receive_buffer_bytes"] = PrepareReceiving(fd.get(), wanted_buffer_bytes_);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw Problem(interface_, std::string("cannot be opened: ") + std::strerror(errno));
  Watch(poll_.get(), fd.get());
  socket_ = std::move(fd);
  kernel_drops_ = 0;
}

void SocketCanSource::Close() {
  socket_ = FileDescriptor();  // closing takes it out of the epoll
  SetRetryTimer(retry_timer_.get(), true);
}

void SocketCanSource::TryOpenAgain() {
  std::uint64_t expirations = 0;
  if (read(retry_timer_.get(), &expirations, sizeof expirations) < 0) return;
  try {
    Open();
  } catch (const std::runtime_error&) {
    return;  // still gone; the timer runs on
  }
  SetRetryTimer(retry_timer_.get(), false);
  ++counters_["can_interface_back"];
}

std::vector<ReceivedFrame> SocketCanSource::Receive() {
  std::vector<ReceivedFrame> frames;
  if (!socket_) TryOpenAgain();
  std::array<std::uint8_t, CANFD_MTU> buffer{};
  while (socket_ && frames.size() < kMaxFramesPerCall) {
    const ReceivedMessage received = ReceiveMessage(socket_.get(), buffer, &kernel_drops_);
    if (received.error == EAGAIN) break;
    if (received.error == ENODEV) {
      ++counters_["can_interface_gone"];
      Close();
      break;
    }
    if (received.error != 0) {
      ++counters_[received.error == ENETDOWN ? "can_interface_down" : "can_receive_errors"];
      break;
    }
    if (received.dropped > 0) counters_["can_frames_dropped"] += received.dropped;
    const std::optional<CanFrame> frame = ToFrame(Bytes(buffer).first(received.size));
    if (frame)
      frames.push_back({*frame, received.recv});
    else
      ++counters_["can_receive_errors"];
  }
  return frames;
}

}  // namespace seastitch
