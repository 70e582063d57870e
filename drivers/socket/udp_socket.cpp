#include "drivers/socket/udp_socket.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>

#include "drivers/socket/receive.hpp"
#include "drivers/socket/source_url.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;

std::runtime_error Problem(const SourceUrl& url, const std::string& reason) {
  return std::runtime_error(url.text + ": " + reason);
}

std::runtime_error SystemProblem(const SourceUrl& url, const char* what) {
  return Problem(url, std::string(what) + ": " + std::strerror(errno));
}

sockaddr_in AddressOf(const SourceUrl& url) {
  const std::size_t colon = url.address.rfind(':');
  if (colon == std::string::npos) throw Problem(url, "expected udp:HOST:PORT");
  const std::string port_text = url.address.substr(colon + 1);
  std::uint16_t port = 0;
  const char* const end = port_text.data() + port_text.size();
  const auto [stop, error] = std::from_chars(port_text.data(), end, port);
  if (error != std::errc() || stop != end || port == 0)
    throw Problem(url, "'" + port_text + "' is not a port, 1 to 65535");

  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const std::string host = url.address.substr(0, colon);
  if (const int code = getaddrinfo(host.c_str(), nullptr, &hints, &found); code != 0)
    throw Problem(url, "'" + host + "': " + gai_strerror(code));
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  freeaddrinfo(found);
  address.sin_port = htons(port);
  return address;
}

void Join(const SourceUrl& url, int fd, in_addr group) {
  ip_mreqn request{};
  request.imr_multiaddr = group;
  if (const std::string name = url.Option("interface", ""); !name.empty()) {
    request.imr_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
    if (request.imr_ifindex == 0) throw Problem(url, "no such interface: " + name);
  }
  const int off = 0;
  // Only our own group, not those that other processes joined on the same port.
  setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request) != 0)
    throw SystemProblem(url, "cannot join the group");
}

}  // namespace

UdpSocket::UdpSocket(const std::string& text, int receive_buffer_bytes)
    : buffer_(kLargestDatagram) {
  const SourceUrl url = ParseSourceUrl(text, {"interface"});
  if (url.scheme != "udp") throw Problem(url, "expected udp:HOST:PORT");
  const sockaddr_in address = AddressOf(url);
  const bool multicast = IN_MULTICAST(ntohl(address.sin_addr.s_addr));
  if (!multicast && url.options.contains("interface"))
    throw Problem(url, "option interface is for multicast groups");
  fd_ = FileDescriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd_) throw SystemProblem(url, "cannot open a socket");
  const int on = 1;
  if (multicast) setsockopt(fd_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw SystemProblem(url, "cannot listen");
  if (multicast) Join(url, fd_.get(), address.sin_addr);
  receive_buffer_bytes_ = PrepareReceiving(fd_.get(), receive_buffer_bytes);
}

bool UdpSocket::Receive(Datagram* datagram) {
  while (true) {
    const ReceivedMessage received = ReceiveMessage(fd_.get(), buffer_, &kernel_drops_);
    if (received.error == EAGAIN) return false;
    if (received.error != 0) {
      ++counters_["udp_receive_errors"];
      return false;
    }
    if (received.dropped > 0) counters_["udp_dropped"] += received.dropped;
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
}

}  // namespace seastitch
