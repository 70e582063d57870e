#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

// A UDP port of 127.0.0.1 that nobody had a moment ago.
inline int FreeUdpPort() {
  const FileDescriptor fd(socket(AF_INET, SOCK_DGRAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  socklen_t size = sizeof address;
  getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

class UdpSender {
 public:
  // from: an address of this machine, as all of 127.0.0.0/8 are; empty: the kernel's choice.
  explicit UdpSender(int port, const std::string& host = "127.0.0.1", const std::string& from = "")
      : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, host.c_str(), &to_.sin_addr);
    const in_addr loopback{htonl(INADDR_LOOPBACK)};
    setsockopt(fd_.get(), IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback);
    if (from.empty()) return;
    sockaddr_in own{};
    own.sin_family = AF_INET;
    EXPECT_EQ(inet_pton(AF_INET, from.c_str(), &own.sin_addr), 1);
    EXPECT_EQ(bind(fd_.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
  }
  void Send(const std::vector<std::uint8_t>& bytes) const {
    const ssize_t sent = sendto(fd_.get(),
                                bytes.data(),
                                bytes.size(),
                                0,
                                reinterpret_cast<const sockaddr*>(&to_),
                                sizeof to_);
    EXPECT_EQ(sent, static_cast<ssize_t>(bytes.size()));
  }

 private:
  FileDescriptor fd_;
  sockaddr_in to_{};
};

// A device that serves its data over TCP on a port of 127.0.0.1; one client at a time.
class TcpServer {
 public:
  explicit TcpServer(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    const int on = 1;
    setsockopt(fd_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_port = htons(static_cast<std::uint16_t>(port));
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    EXPECT_EQ(listen(fd_.get(), 1), 0);
  }
  // Whether a client came within 20 s.
  bool Accept() {
    pollfd waiting{fd_.get(), POLLIN, 0};
    if (poll(&waiting, 1, 20'000) <= 0) return false;
    client_ = FileDescriptor(accept(fd_.get(), nullptr, nullptr));
    const int on = 1;
    setsockopt(client_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return static_cast<bool>(client_);
  }
  void Send(std::span<const std::uint8_t> bytes) const {
    EXPECT_EQ(send(client_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  void Close() { client_ = FileDescriptor(); }
  // As a device whose power failed and came back.
  void Reset() {
    const linger now{1, 0};
    setsockopt(client_.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    Close();
  }

 private:
  FileDescriptor fd_, client_;
};

inline bool WaitReadable(int fd, int timeout_ms = 5000) {
  pollfd waiting{fd, POLLIN, 0};
  return poll(&waiting, 1, timeout_ms) > 0;
}

}  // namespace seastitch
