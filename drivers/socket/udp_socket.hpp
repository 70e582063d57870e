#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/can_frame.hpp"
#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

struct Datagram {
  std::vector<std::uint8_t> bytes;
  Time recv;                 // the kernel's stamp
  std::uint64_t sender = 0;  // IPv4 address and port, to tell senders apart
};

// Receives IPv4 datagrams. A host of 224.0.0.0/4 is a multicast group and is joined; its port may
// be shared with other receivers. Any other host is the local address to listen on (0.0.0.0: all).
class UdpSocket {
 public:
  // "udp:HOST:PORT[?interface=eth1]", the interface (name) on which to join. Throws
  // std::runtime_error "URL: reason".
  UdpSocket(const std::string& url, int receive_buffer_bytes);

  int fd() const { return fd_.get(); }
  // Takes one datagram; false when none waits. Truncated ones are counted, never given.
  bool Receive(Datagram* datagram);

  // udp_dropped (receive buffer full), udp_truncated, udp_receive_errors.
  const Counters& counters() const { return counters_; }
  // What the kernel granted; net.core.rmem_max caps it without an error.
  int receive_buffer_bytes() const { return receive_buffer_bytes_; }

 private:
  FileDescriptor fd_;
  int receive_buffer_bytes_ = 0;
  std::uint32_t kernel_drops_ = 0;
  std::vector<std::uint8_t> buffer_;
  Counters counters_;
};

}  // namespace seastitch
