#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Extracts lines of text from bytes that come in pieces of any size: from a serial port, or from
// datagrams that a gateway splits anywhere. A line ends at CR or LF, before a '$', and after the
// checksum of an NMEA sentence, because some instruments send no line end.
class LineStream {
 public:
  static constexpr std::size_t kLongest =
      1024;  // longer text is counted as bytes without a line end

  struct Line {
    std::string text;
    Time recv;  // receive time of the piece in which it began
  };

  std::vector<Line> Add(Bytes piece, Time recv);
  // Number of bytes without a line end.
  std::int64_t too_long_bytes() const { return too_long_bytes_; }

 private:
  bool IsWholeSentence() const;
  void End(std::vector<Line>* lines);

  Line open_;
  std::int64_t too_long_bytes_ = 0;
};

}  // namespace seastitch
