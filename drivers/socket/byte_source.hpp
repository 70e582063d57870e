#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/counters.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {

// Where the bytes of an instrument come from, whatever carries them.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  // Readable when Receive() has something to do. The same for the life of the source.
  virtual int fd() const = 0;
  // Takes a piece; false where none waits.
  virtual bool Receive(Datagram* piece) = 0;
  // Call it for a piece that turned out to be the instrument's: see SenderGate.
  virtual void Understood(const Datagram&) {}
  // Call it once a second.
  virtual void Check() = 0;

  // Nothing will ever come again: the end of a log.
  virtual bool finished() const { return false; }

  // What keeps bytes from coming, for people; empty where nothing does.
  virtual std::string trouble() const = 0;
  // Of a CAN bus: what the controller says of the wire (CanErrors).
  virtual std::string can_trouble() const { return ""; }
  // Of the last datagram of another sender: see SenderGate.
  virtual std::string refusal() const { return ""; }
  virtual Counters counters() const = 0;
};

// udp:HOST:PORT[...] (UdpSocket), tcp:HOST:PORT (TcpSocket; its buffer is the kernel's affair) or
// serial:/dev/NAME[...] (SerialPort). Throws std::runtime_error "URL: reason".
std::unique_ptr<ByteSource> OpenByteSource(const std::string& url, int receive_buffer_bytes);
// A CAN bus (CanSource), its frames as cannelloni packets (PackReceived).
std::unique_ptr<ByteSource> OpenCanBytes(const std::string& url,
                                         const std::vector<CanFilter>& filters,
                                         int receive_buffer_bytes);

}  // namespace seastitch
