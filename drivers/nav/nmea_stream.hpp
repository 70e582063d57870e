#pragma once

#include <functional>
#include <string>

#include "codecs/line_stream.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

// What the codecs of NMEA 0183 share: lines to sentences, and what became of them.
class NmeaStream {
 public:
  explicit NmeaStream(bool needs_checksum) : needs_checksum_(needs_checksum) {}

  // True where it was read; false where it is of a type that is not.
  using Take = std::function<bool(const NmeaSentence& sentence, Time recv)>;
  // Of a line that is no sentence; true where it was read.
  using TakeLine = std::function<bool(const std::string& line, Time recv)>;
  void Add(Bytes bytes, Time recv, const Take& take, const TakeLine& take_line = nullptr);

  std::int64_t heard() const { return heard_; }
  std::string hears_instead() const;
  // nmea_malformed, nmea_checksum_wrong, nmea_checksum_missing, nmea_other (sentences of types that
  // are not read), nmea_too_long (bytes).
  Counters counters() const;

 private:
  bool needs_checksum_;
  LineStream lines_;
  OtherSentences others_;
  std::int64_t heard_ = 0;
  Counters counters_;
};

}  // namespace seastitch
