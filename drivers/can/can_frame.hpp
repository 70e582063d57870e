#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// One frame of a CAN or CAN FD bus.
struct CanFrame {
  std::uint32_t id = 0;  // 11 or 29 bits; of an error frame: its error class bits
  bool extended = false;
  bool remote = false;
  bool error = false;
  bool fd = false;
  std::uint8_t fd_flags = 0;  // 1 bit rate switch, 2 error state; classic frames: 0
  std::uint8_t length = 0;    // bytes of data; of a remote frame: the length asked for
  std::array<std::uint8_t, 64> bytes{};

  // Empty for a remote frame.
  Bytes data() const { return {bytes.data(), remote ? std::size_t{0} : std::size_t{length}}; }
  // At most 64 bytes; more than 8 only with fd.
  void SetData(Bytes data);

  friend bool operator==(const CanFrame& a, const CanFrame& b) = default;
};

// With its receive stamp (of the kernel, or as a log has it).
struct ReceivedFrame {
  CanFrame frame;
  Time recv;
};

// Frames that a decoder needs.
struct CanFilter {
  std::uint32_t id = 0;
  bool extended = false;
  std::uint32_t mask = 0x1FFFFFFF;  // of the bits of the id that count
  friend auto operator<=>(const CanFilter&, const CanFilter&) = default;
};
// Data frames that pass one of the filters, and every error frame.
bool Passes(const std::vector<CanFilter>& filters, const CanFrame& frame);

// SocketCAN's id word: flags in the top three bits.
constexpr std::uint32_t kCanExtended = 0x80000000;
constexpr std::uint32_t kCanRemote = 0x40000000;
constexpr std::uint32_t kCanError = 0x20000000;
std::uint32_t IdWord(const CanFrame& frame);
// Sets id, extended, remote and error.
void SetIdWord(std::uint32_t word, CanFrame* frame);

}  // namespace seastitch
