#include "common/runtime/process/own_sockets.hpp"

#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <vector>

namespace seastitch {
namespace {

struct OpenSocket {
  std::string name;
  std::uint64_t inode = 0;
  std::uint32_t drops = 0;
  std::int64_t buffer_bytes = 0;
};

std::string UdpName(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  // The port has the same offset in IPv4 and IPv6 addresses.
  sockaddr_in with_port{};
  std::memcpy(&with_port, &address, sizeof with_port);
  const int port = ntohs(with_port.sin_port);
  return port == 0 ? ""
                   : "udp_" + std::to_string(port);  // a socket without a port receives nothing
}

std::string NameOf(int fd) {
  int domain = 0;
  int type = 0;
  socklen_t size = sizeof(int);
  if (getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0) return "";
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0) return "";
  if (domain == AF_CAN) return "can";
  const bool internet = domain == AF_INET || domain == AF_INET6;
  return internet && type == SOCK_DGRAM ? UdpName(fd) : "";
}

std::optional<OpenSocket> SocketAt(int fd) {
  struct stat status {};
  if (fstat(fd, &status) != 0 || !S_ISSOCK(status.st_mode)) return std::nullopt;
  OpenSocket socket;
  socket.name = NameOf(fd);
  if (socket.name.empty()) return std::nullopt;
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof memory;
  if (getsockopt(fd, SOL_SOCKET, SO_MEMINFO, memory.data(), &size) != 0) return std::nullopt;
  socket.inode = status.st_ino;
  socket.drops = memory[SK_MEMINFO_DROPS];
  socket.buffer_bytes =
      memory[SK_MEMINFO_RCVBUF] / 2;  // the kernel reports twice the requested size
  return socket;
}

std::vector<OpenSocket> OpenSockets() {
  std::vector<OpenSocket> sockets;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", ignored)) {
    const std::string number = entry.path().filename().string();
    int fd = -1;
    std::from_chars(number.data(), number.data() + number.size(), fd);
    if (const auto socket = SocketAt(fd)) sockets.push_back(*socket);
  }
  return sockets;
}

}  // namespace

const std::map<std::string, SocketFigures>& OwnSockets::Read() {
  std::map<std::uint64_t, std::uint32_t> drops;
  std::map<std::string, std::int64_t> buffers;
  for (const OpenSocket& socket : OpenSockets()) {
    if (!drops.emplace(socket.inode, socket.drops).second)
      continue;  // a second descriptor of the same socket
    const auto before = drops_.find(socket.inode);
    const std::uint32_t old = before == drops_.end() ? 0 : before->second;
    figures_[socket.name].drops += static_cast<std::uint32_t>(socket.drops - old);
    const auto [smallest, first] = buffers.emplace(socket.name, socket.buffer_bytes);
    if (!first) smallest->second = std::min(smallest->second, socket.buffer_bytes);
  }
  for (const auto& [name, bytes] : buffers) figures_[name].buffer_bytes = bytes;
  drops_ = std::move(drops);
  return figures_;
}

}  // namespace seastitch
