#include "drivers/nav/nmea_stream.hpp"

namespace seastitch {

void NmeaStream::Add(Bytes bytes, Time recv, const Take& take, const TakeLine& take_line) {
  for (const LineStream::Line& line : lines_.Add(bytes, recv)) {
    if (take_line && take_line(line.text, line.recv)) {
      ++heard_;
      continue;
    }
    const auto sentence = ParseNmea(line.text, needs_checksum_, &counters_);
    if (!sentence) continue;
    if (take(*sentence, line.recv))
      ++heard_;
    else
      others_.Add(sentence->type);
  }
}

std::string NmeaStream::hears_instead() const {
  if (others_.count() > 0) return others_.names();
  for (const auto& [name, count] : counters())
    if (count > 0) return "bytes that are no sentences (the baud rate?)";
  return "";
}

Counters NmeaStream::counters() const {
  Counters all = counters_;
  if (others_.count() > 0) all["nmea_other"] = others_.count();
  if (lines_.too_long_bytes() > 0) all["nmea_too_long"] = lines_.too_long_bytes();
  return all;
}

}  // namespace seastitch
