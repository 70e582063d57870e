#include "drivers/nav/nmea_codec.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMostTypes = 16;

}  // namespace

void NmeaCodec::Read(Bytes bytes, Time recv) {
  for (const LineStream::Line& line : lines_.Add(bytes, recv)) {
    if (TakeLine(line.text, line.recv)) {
      CountMessage();
      continue;
    }
    const auto sentence = ParseNmea(line.text, needs_checksum_, &line_counters_);
    if (!sentence) continue;
    if (Take(*sentence, line.recv)) {
      CountMessage();
    } else {
      ++others_;
      if (other_types_.size() < kMostTypes) other_types_.emplace(sentence->type);
    }
  }
}

std::optional<Time> NmeaCodec::Stamp(std::optional<Duration> time_of_day, Time recv) {
  const std::optional<Time> time = clock_.Stamp(time_of_day, recv);
  if (!time) Count("unstamped");
  return time;
}

std::string NmeaCodec::unused_messages() const {
  std::string text;
  for (const std::string& type : other_types_) text += (text.empty() ? "" : ", ") + type;
  if (!text.empty()) return text;
  for (const auto& [name, count] : of_lines())
    if (count > 0) return "bytes that are no sentences (the baud rate?)";
  return "";
}

Counters NmeaCodec::of_lines() const {
  Counters all = line_counters_;
  if (others_ > 0) all["nmea_other"] = others_;
  if (lines_.too_long_bytes() > 0) all["nmea_too_long"] = lines_.too_long_bytes();
  return all;
}

Counters NmeaCodec::counters() const {
  Counters all = of_lines();
  const Counters own = NavCodec::counters();
  all.insert(own.begin(), own.end());
  return all;
}

}  // namespace seastitch
