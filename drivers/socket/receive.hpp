#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/can/can_frame.hpp"

// What the CAN and the UDP socket have in common: the kernel stamps, counts and buffers.
namespace seastitch {

// Asks for kernel receive stamps, for the count of drops, and for a receive buffer; gives the size
// that was granted.
int PrepareReceiving(int fd, int receive_buffer_bytes);

struct ReceivedMessage {
  int error = 0;  // errno; EAGAIN where nothing waits. Then nothing below is set
  std::size_t size = 0;
  bool truncated = false;
  Time recv;                  // when the kernel took it from the device
  std::uint32_t dropped = 0;  // since the message before, for want of buffer
  sockaddr_in sender{};       // of a UDP datagram
};

// Receives one message without waiting. *kernel_drops is the socket's running count.
ReceivedMessage ReceiveMessage(int fd, std::span<std::uint8_t> buffer, std::uint32_t* kernel_drops);

}  // namespace seastitch
