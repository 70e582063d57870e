#pragma once

#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "drivers/socket/patient_socket.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Reads a serial port: 8 data bits, no parity, one stop bit, no handshake. Nobody else may open it
// meanwhile. A port that is missing or was unplugged is waited for.
class SerialPort {
 public:
  // "serial:/dev/ttyUSB0[?baud=9600]". Throws std::runtime_error "URL: reason".
  explicit SerialPort(const std::string& url);

  int fd() const { return port_.fd(); }
  // Takes what waits; false where nothing does. recv: when its first bit came, by the rate, since a
  // port gives no stamps.
  bool Receive(Datagram* piece);
  // Reads the port's own counts of errors. Call it regularly.
  void CheckErrors();
  // Why nothing can come, for people; empty while it is open.
  const std::string& trouble() const { return port_.trouble(); }

  // serial_lost (the port went away); serial_framing_errors (a wrong rate, noise) and
  // serial_overruns (the computer was late), where the port counts them.
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
