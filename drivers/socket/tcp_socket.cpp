#include "drivers/socket/tcp_socket.hpp"

#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "drivers/socket/receive.hpp"

namespace seastitch {
namespace {

// TCP keep-alive probes; a device on the vehicle's network answers within milliseconds
constexpr int kMostChecks = 3;

// A device that loses power does not close its connection: TCP probes it after seconds of silence.
void KeepAlive(int fd) {
  const auto set = [fd](int level, int option, int value) {
    setsockopt(fd, level, option, &value, sizeof value);
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 2);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
}

}  // namespace

TcpSocket::TcpSocket(const std::string& url)
    : url_(ParseSourceUrl(url, {})),
      address_(AddressOf(url_)),
      buffer_(65'536),
      socket_(
          url, [this] { return Open(); }, false) {}

FileDescriptor TcpSocket::Open() {
  FileDescriptor fd(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) throw NotYet(std::strerror(errno));
  const int on = 1;
  setsockopt(fd.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  KeepAlive(fd.get());
  checks_ = 0;
  const auto* const address = reinterpret_cast<const sockaddr*>(&address_);
  if (connect(fd.get(), address, sizeof address_) != 0 && errno != EINPROGRESS)
    throw NotYet(trouble_ = std::strerror(errno));
  return fd;
}

bool TcpSocket::Receive(Datagram* piece) {
  socket_.TryToOpen();
  if (!socket_.is_open()) return false;
  std::uint32_t drops = 0;
  const ReceivedMessage received = ReceiveMessage(socket_.get(), buffer_, &drops);
  if (received.error == EAGAIN) return false;
  if (received.error != 0) {
    Lose(std::strerror(received.error));
    return false;
  }
  SetConnected();
  if (received.size == 0) {
    Lose("the device closed the connection");
    return false;
  }
  piece->bytes.assign(buffer_.begin(),
                      buffer_.begin() + static_cast<std::ptrdiff_t>(received.size));
  piece->recv = received.recv;
  piece->sender = 0;
  return true;
}

void TcpSocket::Check() {
  if (!socket_.is_open() || trouble_.empty()) return;
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  if (getpeername(socket_.get(), reinterpret_cast<sockaddr*>(&peer), &size) == 0)
    SetConnected();
  else if (++checks_ >= kMostChecks)
    Lose("no answer");
}

void TcpSocket::SetConnected() {
  if (trouble_.empty()) return;
  trouble_.clear();
  ++counters_["tcp_connections"];
  spdlog::info("{}: connected", url_.text);
}

void TcpSocket::Lose(const std::string& why) {
  if (trouble_.empty()) ++counters_["tcp_lost"];
  if (why != trouble_) spdlog::warn("{}: {}; trying again every second", url_.text, why);
  trouble_ = why;
  socket_.Lose(why);
}

}  // namespace seastitch
