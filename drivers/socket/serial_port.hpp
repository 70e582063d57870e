#pragma once

#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Opens "serial:DEVICE[?baud=9600]" with 8 data bits, no parity, one stop bit, no handshake,
// without waiting in read() and write(), and for no other process. access: of open(), such as
// O_RDONLY. Throws NotYet while the port is missing.
FileDescriptor OpenSerialPort(const SourceUrl& url, int access);

// Reads a serial port (OpenSerialPort). It retries while the port is missing or unplugged.
class SerialPort {
 public:
  // "serial:/dev/ttyUSB0[?baud=9600]". Throws std::runtime_error "URL: reason".
  explicit SerialPort(const std::string& url);

  int fd() const { return port_.fd(); }
  // Takes the received bytes; false if there are none. recv: arrival of the first bit, computed
  // from the time of the read call and the baud rate, because the kernel does not stamp serial
  // data.
  bool Receive(Datagram* piece);
  // Reads the port's own counts of errors. Call it regularly.
  void CheckErrors();
  // Why it cannot receive, for people; empty while it is open.
  const std::string& trouble() const { return port_.trouble(); }

  // serial_lost (the port disappeared); serial_framing_errors (wrong baud rate, noise) and
  // serial_overruns (bytes lost before the computer read them), if the port counts them.
  const Counters& counters() const { return counters_; }

 private:
  SourceUrl url_;
  int baud_;
  std::vector<std::uint8_t> buffer_;
  Counters counters_;
  PatientSocket port_;
};

}  // namespace seastitch
