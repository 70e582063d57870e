#include "drivers/socket/socket_can.hpp"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "drivers/socket/receive.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxFramesPerCall = 256;  // limit, so that the event loop can do other work

std::runtime_error Problem(const std::string& interface, const std::string& reason) {
  return std::runtime_error("can:" + interface + ": " + reason);
}

std::vector<can_filter> KernelFilters(const std::vector<CanFilter>& filters) {
  std::vector<can_filter> kernel;
  for (const CanFilter& filter : filters)
    kernel.push_back({filter.id | (filter.extended ? CAN_EFF_FLAG : 0U),
                      (filter.mask & (filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK)) |
                          CAN_EFF_FLAG | CAN_RTR_FLAG});
  return kernel;
}

// The frame; nothing if the kernel's structure has an impossible size.
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
      socket_("can:" + interface, [this] { return Open(); }) {}

FileDescriptor SocketCanSource::Open() {
  FileDescriptor fd(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (!fd && (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT))
    throw Problem(interface_, std::string("this kernel has no CAN: ") + std::strerror(errno));
  if (!fd) throw NotYet(std::string("no socket: ") + std::strerror(errno));
  const unsigned index = if_nametoindex(interface_.c_str());
  if (index == 0) throw NotYet("no such interface");
  // Before bind(), so that frames that are not wanted never fill the buffer.
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
  counters_["can_receive_buffer_bytes"] =
      PrepareReceiving("can:" + interface_, fd.get(), wanted_buffer_bytes_);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw NotYet(std::string("cannot be opened: ") + std::strerror(errno));
  kernel_drops_ = 0;
  return fd;
}

std::vector<ReceivedFrame> SocketCanSource::Receive() {
  std::vector<ReceivedFrame> frames;
  if (socket_.TryToOpen()) ++counters_["can_interface_back"];
  std::array<std::uint8_t, CANFD_MTU> buffer{};
  while (socket_.is_open() && frames.size() < kMaxFramesPerCall) {
    const ReceivedMessage received = ReceiveMessage(socket_.get(), buffer, &kernel_drops_);
    if (received.error == EAGAIN) break;
    if (received.error == ENODEV) {
      ++counters_["can_interface_gone"];
      ++outages_;
      socket_.Lose("interface is gone");
      break;
    }
    if (received.error != 0) {
      ++counters_[received.error == ENETDOWN ? "can_interface_down" : "can_receive_errors"];
      if (received.error == ENETDOWN) ++outages_;
      break;
    }
    if (received.dropped > 0) counters_["can_frames_dropped"] += received.dropped;
    if (!received.stamped) ++counters_["can_frames_unstamped"];
    const std::optional<CanFrame> frame = ToFrame(Bytes(buffer).first(received.size));
    if (frame)
      frames.push_back({*frame, received.recv});
    else
      ++counters_["can_receive_errors"];
  }
  return frames;
}

std::string SocketCanSource::trouble() const {
  if (!socket_.is_open()) return socket_.trouble();
  ifreq request{};
  interface_.copy(request.ifr_name, IFNAMSIZ - 1);
  const bool known = ioctl(socket_.get(), SIOCGIFFLAGS, &request) == 0;
  return known && (request.ifr_flags & IFF_UP) == 0 ? "interface is down" : "";
}

}  // namespace seastitch
