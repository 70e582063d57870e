#include "drivers/socket/udp_socket.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "drivers/socket/receive.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;

std::runtime_error Problem(const SourceUrl& url, const std::string& reason) {
  return std::runtime_error(url.text + ": " + reason);
}

NotYet SystemProblem(const char* what) {
  return NotYet(std::string(what) + ": " + std::strerror(errno));
}

// interface: its index; 0 lets the kernel choose.
void Join(int fd, in_addr group, unsigned interface) {
  ip_mreqn request{};
  request.imr_multiaddr = group;
  request.imr_ifindex = static_cast<int>(interface);
  const int off = 0;
  // Receives only the group joined here, not groups that other processes joined on the same port.
  setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request) != 0)
    throw SystemProblem("cannot join the group");
}

SourceUrl UdpUrl(const std::string& text) {
  SourceUrl url = ParseSourceUrl(text, {"interface", "from"});
  if (url.scheme != "udp") throw Problem(url, "expected udp:HOST:PORT");
  return url;
}

bool IsMulticast(const sockaddr_in& address) {
  return IN_MULTICAST(ntohl(address.sin_addr.s_addr));
}

}  // namespace

UdpSocket::UdpSocket(const std::string& url, int receive_buffer_bytes)
    : url_(UdpUrl(url)),
      address_(AddressOf(url_)),
      gate_(GateOf(url_)),
      wanted_buffer_bytes_(receive_buffer_bytes),
      buffer_(kLargestDatagram),
      socket_(url, [this] { return Open(); }) {
  if (!IsMulticast(address_) && url_.options.contains("interface"))
    throw Problem(url_, "option interface is for multicast groups");
}

FileDescriptor UdpSocket::Open() {
  const std::string interface = url_.Option("interface", "");
  joined_index_ = if_nametoindex(interface.c_str());
  if (!interface.empty() && joined_index_ == 0) throw NotYet("no such interface: " + interface);
  FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) throw SystemProblem("cannot open a socket");
  const int on = 1;
  if (IsMulticast(address_)) setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address_), sizeof address_) != 0)
    throw SystemProblem("cannot listen");
  if (IsMulticast(address_)) Join(fd.get(), address_.sin_addr, joined_index_);
  counters_["udp_receive_buffer_bytes"] =
      PrepareReceiving(url_.text, fd.get(), wanted_buffer_bytes_);
  kernel_drops_ = 0;
  return fd;
}

void UdpSocket::CheckInterface() {
  const std::string interface = url_.Option("interface", "");
  if (!socket_.is_open() || if_nametoindex(interface.c_str()) == joined_index_) return;
  ++counters_["udp_interface_gone"];
  socket_.Lose("interface is gone: " + interface);
}

void UdpSocket::Understood(const Datagram& datagram) {
  gate_.Understood(static_cast<std::uint32_t>(datagram.sender >> 16), datagram.recv);
}

bool UdpSocket::Receive(Datagram* datagram) {
  socket_.TryToOpen();
  while (socket_.is_open()) {
    const ReceivedMessage received = ReceiveMessage(socket_.get(), buffer_, &kernel_drops_);
    if (received.error == EAGAIN) return false;
    if (received.error != 0) {
      ++counters_["udp_receive_errors"];
      return false;
    }
    if (received.dropped > 0) counters_["udp_dropped"] += received.dropped;
    if (!received.stamped) ++counters_["udp_unstamped"];
    if (!gate_.Accepts(ntohl(received.sender.sin_addr.s_addr), received.recv)) {
      ++counters_["udp_refused_senders"];
      continue;
    }
    if (received.truncated) {
      ++counters_["udp_truncated"];
      continue;
    }
    const auto size = static_cast<std::ptrdiff_t>(received.size);
    datagram->bytes.assign(buffer_.begin(), buffer_.begin() + size);
    datagram->recv = received.recv;
    datagram->sender = std::uint64_t{ntohl(received.sender.sin_addr.s_addr)} << 16 |
                       ntohs(received.sender.sin_port);
    return true;
  }
  return false;
}

}  // namespace seastitch
