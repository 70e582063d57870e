#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/health/counters.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Source of an instrument's bytes, independent of the transport.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  // Readable when Receive() has something to do. The same for the life of the source.
  virtual int fd() const = 0;
  // Takes a piece; false if there is none.
  virtual bool Receive(Datagram* piece) = 0;
  // Call it for a piece that the codec could decode: see SenderGate.
  virtual void Understood(const Datagram&) {}
  // Call it once a second.
  virtual void Check() = 0;

  // True at the end of a log: no bytes will come any more.
  virtual bool finished() const { return false; }

  // Reason why no bytes can come, for people; empty if there is none.
  virtual std::string trouble() const = 0;
  // Of a CAN bus: state of the controller (CanErrors).
  virtual std::string can_trouble() const { return ""; }
  // Datagrams of other senders: see SenderGate.
  virtual SenderRefusal refusal() const { return {}; }
  virtual Counters counters() const = 0;
};

// udp:HOST:PORT[...] (UdpSocket), tcp:HOST:PORT (TcpSocket, with the kernel's own buffer size) or
// serial:/dev/NAME[...] (SerialPort). Throws std::runtime_error "URL: reason".
std::unique_ptr<ByteSource> OpenByteSource(const std::string& url, int receive_buffer_bytes);
// A CAN bus (CanSource); returns its frames as cannelloni packets (PackReceived).
std::unique_ptr<ByteSource> OpenCanBytes(const std::string& url,
                                         const std::vector<CanFilter>& filters,
                                         int receive_buffer_bytes);

}  // namespace seastitch
