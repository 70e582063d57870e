#include "drivers/socket/receive.hpp"

#include <netdb.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace seastitch {
namespace {

Time ToTime(const timespec& t) {
  return FromUtime(std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000);
}

}  // namespace

Time SystemNow() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return ToTime(now);
}

sockaddr_in AddressOf(const SourceUrl& url) {
  const auto [host, port] = HostPortOf(url);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;  // one result per address
  addrinfo* found = nullptr;
  if (const int code = getaddrinfo(host.c_str(), nullptr, &hints, &found); code != 0)
    throw std::runtime_error(url.text + ": '" + host + "': " + gai_strerror(code));
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  freeaddrinfo(found);
  address.sin_port = htons(port);
  return address;
}

int PrepareReceiving(const std::string& name, int fd, int receive_buffer_bytes) {
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  // With CAP_NET_ADMIN the size may exceed net.core.rmem_max.
  if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &receive_buffer_bytes, sizeof(int)) != 0)
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(int));
  int granted = 0;
  socklen_t size = sizeof granted;
  getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  granted /= 2;  // the kernel reports twice the requested size, including its own bookkeeping
  if (granted < receive_buffer_bytes)
    spdlog::warn("{}: receive buffer is {} of {} bytes: raise net.core.rmem_max",
                 name,
                 granted,
                 receive_buffer_bytes);
  return granted;
}

ReceivedMessage ReceiveMessage(int fd,
                               std::span<std::uint8_t> buffer,
                               std::uint32_t* kernel_drops) {
  ReceivedMessage received;
  iovec part{buffer.data(), buffer.size()};
  alignas(cmsghdr) char control[256];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  message.msg_name = &received.sender;
  message.msg_namelen = sizeof received.sender;
  ssize_t size = 0;
  do {
    size = recvmsg(fd, &message, MSG_DONTWAIT);
  } while (size < 0 && errno == EINTR);
  if (size < 0) {
    received.error = errno;
    return received;
  }
  received.size = static_cast<std::size_t>(size);
  received.truncated = (message.msg_flags & MSG_TRUNC) != 0;
  received.stamped = false;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      received.recv = ToTime(stamp);
      received.stamped = true;
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t total = 0;
      std::memcpy(&total, CMSG_DATA(c), sizeof total);
      received.dropped = total - *kernel_drops;
      *kernel_drops = total;
    }
  }
  if (!received.stamped) received.recv = SystemNow();
  return received;
}

}  // namespace seastitch
