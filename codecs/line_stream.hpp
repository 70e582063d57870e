#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Lines of text out of bytes that come in pieces of any size: of a serial port, or of datagrams
// that a gateway cut where it liked. A line ends at CR or LF, before a '$', and behind the
// checksum of an NMEA sentence, which some instruments send without a line end.
class LineStream {
 public:
  static constexpr std::size_t kLongest = 1024;  // what has no end by then is no line

  struct Line {
    std::string text;
    Time recv;  // of the piece in which it began
  };

  std::vector<Line> Add(Bytes piece, Time recv);
  // Bytes of lines without an end.
  std::int64_t too_long_bytes() const { return too_long_bytes_; }

 private:
  bool IsWholeSentence() const;
  void End(std::vector<Line>* lines);

  Line open_;
  std::int64_t too_long_bytes_ = 0;
};

}  // namespace seastitch
