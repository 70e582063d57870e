#pragma once

#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Reads a serial port: 8 data bits, no parity, one stop bit, no handshake. No other process can
// open it meanwhile. It retries while the port is missing or unplugged.
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
  FileDescriptor Open() const;

  SourceUrl url_;
  int baud_;
  std::vector<std::uint8_t> buffer_;
  Counters counters_;
  PatientSocket port_;
};

}  // namespace seastitch
