#include "drivers/socket/serial_port.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/socket/receive.hpp"

namespace seastitch {
namespace {

constexpr double kBitsPerByte = 10.0;  // with start and stop bit

speed_t SpeedOf(int baud) {
  constexpr std::pair<int, speed_t> kSpeeds[] = {{1200, B1200},
                                                 {2400, B2400},
                                                 {4800, B4800},
                                                 {9600, B9600},
                                                 {19'200, B19200},
                                                 {38'400, B38400},
                                                 {57'600, B57600},
                                                 {115'200, B115200},
                                                 {230'400, B230400},
                                                 {460'800, B460800},
                                                 {921'600, B921600}};
  for (const auto& [rate, speed] : kSpeeds)
    if (rate == baud) return speed;
  return B0;
}

NotYet Problem(const char* what) { return NotYet(std::string(what) + ": " + std::strerror(errno)); }

}  // namespace

FileDescriptor OpenSerialPort(const SourceUrl& url, int access) {
  FileDescriptor fd(open(url.address.c_str(), access | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd) throw Problem("cannot open the port");
  termios settings{};
  if (tcgetattr(fd.get(), &settings) != 0) throw NotYet("is not a serial port");
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cc[VMIN] = 1;  // read() gives EAGAIN without data, and 0 if the port is gone
  settings.c_cc[VTIME] = 0;
  cfsetispeed(&settings, SpeedOf(BaudOf(url)));
  cfsetospeed(&settings, SpeedOf(BaudOf(url)));
  if (tcsetattr(fd.get(), TCSANOW, &settings) != 0) throw Problem("cannot set the rate");
  ioctl(fd.get(), TIOCEXCL);
  return fd;
}

SerialPort::SerialPort(const std::string& url)
    : url_(ParseSourceUrl(url, {"baud"})),
      baud_(BaudOf(url_)),
      buffer_(4096),
      port_(url, [this] { return OpenSerialPort(url_, O_RDONLY); }) {}

bool SerialPort::Receive(Datagram* piece) {
  port_.TryToOpen();
  if (!port_.is_open()) return false;
  ssize_t size = 0;
  do {
    size = read(port_.get(), buffer_.data(), buffer_.size());
  } while (size < 0 && errno == EINTR);
  if (size < 0 && errno == EAGAIN) return false;
  if (size <= 0) {
    ++counters_["serial_lost"];
    port_.Lose(size == 0 ? "the port was closed" : std::strerror(errno));
    return false;
  }
  piece->bytes.assign(buffer_.begin(), buffer_.begin() + size);
  piece->recv = SystemNow() - FromSeconds(kBitsPerByte * static_cast<double>(size) / baud_);
  piece->sender = 0;
  return true;
}

void SerialPort::CheckErrors() {
  serial_icounter_struct counts{};
  if (!port_.is_open() || ioctl(port_.get(), TIOCGICOUNT, &counts) != 0) return;
  counters_["serial_framing_errors"] = counts.frame;
  counters_["serial_overruns"] = std::int64_t{counts.overrun} + counts.buf_overrun;
}

}  // namespace seastitch
