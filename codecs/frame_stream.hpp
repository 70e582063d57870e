#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Binary messages out of bytes that come in pieces of any size. Behind damage the next message is
// looked for byte by byte.
class FrameStream {
 public:
  // Of the message that the bytes begin with, whole and with a right checksum: its size. 0: one may
  // begin so, of which bytes are missing. Nothing: none begins so.
  using SizeOf = std::optional<std::size_t> (*)(Bytes bytes);
  struct Frame {
    std::vector<std::uint8_t> bytes;
    Time recv;  // of the piece in which it began
  };

  explicit FrameStream(SizeOf size_of) : size_of_(size_of) {}

  std::vector<Frame> Add(Bytes piece, Time recv);
  // Bytes that were of no message.
  std::int64_t skipped_bytes() const { return skipped_bytes_; }

 private:
  static constexpr std::size_t kLongest = 65'536;
  struct Piece {
    std::size_t bytes;  // that are left of it
    Time recv;
  };
  void Drop(std::size_t bytes);

  SizeOf size_of_;
  std::vector<std::uint8_t> open_;
  std::deque<Piece> pieces_;  // that open_ is made of
  std::int64_t skipped_bytes_ = 0;
};

}  // namespace seastitch
