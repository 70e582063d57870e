#include "drivers/output/byte_sink.hpp"

#include <fcntl.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "drivers/socket/receive.hpp"
#include "drivers/socket/serial_port.hpp"

namespace seastitch {
namespace {

class UdpSink : public ByteSink {
 public:
  explicit UdpSink(const SourceUrl& url)
      : url_(url),
        address_(AddressOf(url_)),
        socket_(
            url.text, [this] { return Open(); }, /*logs=*/false) {}

  void Send(std::string_view lines) override {
    socket_.TryToOpen();
    if (!socket_.is_open()) return;
    const auto* const to = reinterpret_cast<const sockaddr*>(&address_);
    if (sendto(socket_.get(), lines.data(), lines.size(), MSG_DONTWAIT, to, sizeof address_) >= 0) {
      error_.clear();
      return;
    }
    const int error = errno;
    ++counters_["udp_send_errors"];
    error_ = std::strerror(error);
    // An interface that came back has another number: the socket is opened again.
    if (error != EAGAIN && error != ENOBUFS) socket_.Lose(error_);
  }

  void Check() override { socket_.TryToOpen(); }

  std::string trouble() const override { return socket_.is_open() ? error_ : socket_.trouble(); }

 private:
  FileDescriptor Open() const {
    FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd) throw NotYet(std::string("cannot open a socket: ") + std::strerror(errno));
    const int on = 1;
    setsockopt(fd.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
    const std::string interface = url_.Option("interface", "");
    if (interface.empty()) return fd;
    ip_mreqn request{};
    request.imr_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    if (request.imr_ifindex == 0) throw NotYet("no such interface: " + interface);
    setsockopt(fd.get(), IPPROTO_IP, IP_MULTICAST_IF, &request, sizeof request);
    return fd;
  }

  SourceUrl url_;
  sockaddr_in address_;
  std::string error_;  // of the last datagram; empty: it was sent
  PatientSocket socket_;
};

class SerialSink : public ByteSink {
 public:
  explicit SerialSink(const SourceUrl& url)
      : url_(url), port_(url.text, [this] { return OpenSerialPort(url_, O_WRONLY); }) {}

  void Send(std::string_view lines) override {
    if (port_.TryToOpen()) rest_.clear();
    if (!port_.is_open()) return;
    if (!rest_.empty()) Write(std::exchange(rest_, {}));
    if (!port_.is_open()) return;
    // The rest of a line has to go first. A port that takes less than it is given drops whole
    // lines.
    late_ = !rest_.empty();
    if (late_)
      counters_["serial_dropped"] += std::count(lines.begin(), lines.end(), '\n');
    else
      Write(std::string(lines));
  }

  void Check() override {
    if (port_.TryToOpen()) rest_.clear();
  }

  std::string trouble() const override {
    if (!port_.is_open()) return port_.trouble();
    return late_ ? "takes fewer bytes than are sent" : "";
  }

 private:
  // Keeps what the port does not take.
  void Write(std::string text) {
    ssize_t size = 0;
    do {
      size = write(port_.get(), text.data(), text.size());
    } while (size < 0 && errno == EINTR);
    if (size < 0 && errno != EAGAIN) {
      ++counters_["serial_send_errors"];
      port_.Lose(std::strerror(errno));
      return;
    }
    rest_ = text.substr(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  }

  SourceUrl url_;
  PatientSocket port_;
  std::string rest_;
  bool late_ = false;  // the last lines were dropped
};

}  // namespace

void ExpectSink(const std::string& text) {
  const SourceUrl url = ParseSourceUrl(text, {"interface", "baud"});
  if (url.scheme == "udp" || url.scheme == "serial")
    ExpectUsable(text, SourceKind::kBytes);
  else
    throw std::runtime_error(text + ": expected udp:HOST:PORT or serial:/dev/NAME");
}

std::unique_ptr<ByteSink> OpenByteSink(const std::string& text) {
  ExpectSink(text);
  const SourceUrl url = ParseSourceUrl(text, {"interface", "baud"});
  if (url.scheme == "udp") return std::make_unique<UdpSink>(url);
  return std::make_unique<SerialSink>(url);
}

}  // namespace seastitch
