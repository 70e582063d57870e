#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/core/time.hpp"
#include "drivers/socket/source_url.hpp"

// Common code of the sockets: receive stamps, drop counts and buffers of the kernel.
namespace seastitch {

// Time of the system clock, for messages without the kernel's stamp.
Time SystemNow();

// Address of udp:HOST:PORT or tcp:HOST:PORT. Throws std::runtime_error "TEXT: reason".
sockaddr_in AddressOf(const SourceUrl& url);

// Enables kernel receive stamps and drop counts, and requests a receive buffer. Returns the size
// granted, and warns if it is smaller. name: for people.
int PrepareReceiving(const std::string& name, int fd, int receive_buffer_bytes);

struct ReceivedMessage {
  int error = 0;  // errno; EAGAIN if there is no message. Then the fields below are not set
  std::size_t size = 0;
  bool truncated = false;
  Time recv;                  // the kernel's receive stamp; without one, the time of the read call
  bool stamped = true;        // true if recv is the kernel's stamp
  std::uint32_t dropped = 0;  // messages dropped before this one because the buffer was full
  sockaddr_in sender{};       // of a UDP datagram
};

// Receives one message without waiting. *kernel_drops: the socket's running count.
ReceivedMessage ReceiveMessage(int fd, std::span<std::uint8_t> buffer, std::uint32_t* kernel_drops);

}  // namespace seastitch
