#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Extracts binary messages from bytes that come in pieces of any size. After damaged bytes it
// searches for the next message byte by byte.
class FrameStream {
 public:
  // Size of the message at the beginning of the bytes, where it is complete and its checksum is
  // right. 0: more bytes are needed to tell. Absent: no message begins here.
  using SizeOf = std::optional<std::size_t> (*)(Bytes bytes);
  struct Frame {
    std::vector<std::uint8_t> bytes;
    Time recv;  // receive time of the piece in which it began
  };

  explicit FrameStream(SizeOf size_of) : size_of_(size_of) {}

  std::vector<Frame> Add(Bytes piece, Time recv);
  // Number of bytes that belong to no message.
  std::int64_t skipped_bytes() const { return skipped_bytes_; }

 private:
  static constexpr std::size_t kLongest = 65'536;
  struct Piece {
    std::size_t bytes;  // not consumed yet
    Time recv;
  };
  void Drop(std::size_t bytes);

  SizeOf size_of_;
  std::vector<std::uint8_t> open_;
  std::deque<Piece> pieces_;  // the pieces in open_
  std::int64_t skipped_bytes_ = 0;
};

}  // namespace seastitch
