#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/core/time.hpp"
#include "drivers/socket/source_url.hpp"

// What the sockets have in common: the kernel stamps, counts and buffers.
namespace seastitch {

// The system clock: for what the kernel does not stamp.
Time SystemNow();

// Of udp:HOST:PORT or tcp:HOST:PORT. Throws std::runtime_error "TEXT: reason".
sockaddr_in AddressOf(const SourceUrl& url);

// Asks for kernel receive stamps, for the count of drops, and for a receive buffer; gives the size
// that was granted, and warns where it is less. name: for people.
int PrepareReceiving(const std::string& name, int fd, int receive_buffer_bytes);

struct ReceivedMessage {
  int error = 0;  // errno; EAGAIN where nothing waits. Then nothing below is set
  std::size_t size = 0;
  bool truncated = false;
  Time recv;                  // when the kernel took it from the device ...
  bool stamped = true;        // ... or, where it does not say, when we did
  std::uint32_t dropped = 0;  // since the message before, for want of buffer
  sockaddr_in sender{};       // of a UDP datagram
};

// Receives one message without waiting. *kernel_drops is the socket's running count.
ReceivedMessage ReceiveMessage(int fd, std::span<std::uint8_t> buffer, std::uint32_t* kernel_drops);

}  // namespace seastitch
