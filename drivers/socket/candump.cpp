#include "drivers/socket/candump.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>

namespace seastitch {
namespace {

// Latest accepted second, in 2242: microseconds stay far from the limits of int64.
constexpr std::int64_t kLatestSecond = 8'589'934'592;

std::optional<int> HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

template <class T>
bool ReadNumber(std::string_view text, int base, T* value) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, *value, base);
  return error == std::errc() && stop == end && !text.empty();
}

// Time from "1700000000.250000", with any number of digits after the point. Those of parts of a
// microsecond are cut off.
std::optional<Time> ParseTime(std::string_view text) {
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos) return std::nullopt;
  constexpr std::size_t kMicro = 6;
  constexpr std::size_t kMostDigits = 18;
  const std::string_view fraction_text = text.substr(dot + 1);
  std::uint64_t seconds = 0;
  std::uint64_t fraction = 0;
  if (fraction_text.size() > kMostDigits) return std::nullopt;
  if (!ReadNumber(text.substr(0, dot), 10, &seconds)) return std::nullopt;
  if (!ReadNumber(fraction_text, 10, &fraction)) return std::nullopt;
  if (seconds > static_cast<std::uint64_t>(kLatestSecond)) return std::nullopt;
  for (std::size_t digits = fraction_text.size(); digits < kMicro; ++digits) fraction *= 10;
  for (std::size_t digits = fraction_text.size(); digits > kMicro; --digits) fraction /= 10;
  return FromUtime(static_cast<std::int64_t>(seconds * 1'000'000 + fraction));
}

bool ParseId(std::string_view text, CanFrame* frame) {
  std::uint32_t id = 0;
  if (!ReadNumber(text, 16, &id)) return false;
  if (text.size() == 3) {
    frame->id = id;
    return id <= 0x7FF;
  }
  if (text.size() != 8) return false;
  // Eight digits: an extended id, or the class bits of an error frame with SocketCAN's error flag.
  const bool error = (id & kCanError) != 0;
  SetIdWord(error ? id : id | kCanExtended, frame);
  return id <= 0x3FFFFFFF;
}

bool ParseBytes(std::string_view text, std::size_t most, CanFrame* frame) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    if (text[i] == '.' && ++i == text.size()) return false;
    if (i + 1 >= text.size() || n == most) return false;
    const std::optional<int> high = HexDigit(text[i]);
    const std::optional<int> low = HexDigit(text[i + 1]);
    if (!high || !low) return false;
    frame->bytes[n++] = static_cast<std::uint8_t>(*high * 16 + *low);
  }
  frame->length = static_cast<std::uint8_t>(n);
  return true;
}

bool IsFdLength(std::size_t n) {
  return n <= 8 || n == 12 || n == 16 || n == 20 || n == 24 || n == 32 || n == 48 || n == 64;
}

bool ParseRemote(std::string_view text, CanFrame* frame) {
  frame->remote = true;
  if (text.empty()) return true;
  const std::optional<int> length = HexDigit(text[0]);
  if (text.size() != 1 || !length || *length > 8) return false;
  frame->length = static_cast<std::uint8_t>(*length);
  return true;
}

bool ParseFd(std::string_view text, CanFrame* frame) {
  const std::optional<int> flags = text.empty() ? std::nullopt : HexDigit(text[0]);
  if (!flags) return false;
  frame->fd = true;
  frame->fd_flags = static_cast<std::uint8_t>(*flags & 0x3);  // newer tools also set bit 2 (FDF)
  return ParseBytes(text.substr(1), 64, frame) && IsFdLength(frame->length);
}

bool ParseClassic(std::string_view text, CanFrame* frame) {
  if (const std::size_t mark = text.find('_'); mark != std::string_view::npos) {
    // "_9" to "_F": a length code above 8; such a frame still carries 8 bytes.
    const std::optional<int> code =
        mark + 2 == text.size() ? HexDigit(text[mark + 1]) : std::nullopt;
    if (!code || *code < 9) return false;
    return ParseBytes(text.substr(0, mark), 8, frame) && frame->length == 8;
  }
  return ParseBytes(text, 8, frame);
}

bool ParseFrame(std::string_view text, CanFrame* frame) {
  const std::size_t mark = text.find('#');
  if (mark == std::string_view::npos || !ParseId(text.substr(0, mark), frame)) return false;
  const std::string_view body = text.substr(mark + 1);
  if (body.starts_with('#')) return ParseFd(body.substr(1), frame);
  if (body.starts_with('R')) return ParseRemote(body.substr(1), frame);
  return ParseClassic(body, frame);
}

// Takes the first word from the text.
std::string_view TakeWord(std::string_view* text) {
  const std::size_t begin = std::min(text->find_first_not_of(' '), text->size());
  const std::size_t end = std::min(text->find(' ', begin), text->size());
  const std::string_view word = text->substr(begin, end - begin);
  text->remove_prefix(end);
  return word;
}

}  // namespace

std::optional<CandumpLine> ParseCandumpLine(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  std::string_view stamp = TakeWord(&line);
  if (stamp.size() < 2 || stamp.front() != '(' || stamp.back() != ')') return std::nullopt;
  const std::optional<Time> time = ParseTime(stamp.substr(1, stamp.size() - 2));
  const std::string_view interface = TakeWord(&line);
  const std::string_view frame = TakeWord(&line);
  const std::string_view direction = TakeWord(&line);
  if (!time || interface.empty() || !TakeWord(&line).empty()) return std::nullopt;
  if (!direction.empty() && direction != "R" && direction != "T") return std::nullopt;
  CandumpLine parsed{*time, std::string(interface), {}};
  if (!ParseFrame(frame, &parsed.frame)) return std::nullopt;
  return parsed;
}

std::string FormatCandumpLine(const CandumpLine& line) {
  const CanFrame& frame = line.frame;
  const std::int64_t us = ToUtime(line.time);
  char text[64];
  std::snprintf(text,
                sizeof text,
                "(%lld.%06lld) ",
                static_cast<long long>(us / 1'000'000),
                static_cast<long long>(us % 1'000'000));
  std::string out = text + line.interface;
  const std::uint32_t id = frame.id | (frame.error ? kCanError : 0);
  std::snprintf(text, sizeof text, frame.extended || frame.error ? " %08X#" : " %03X#", id);
  out += text;
  if (frame.remote) return out + "R" + (frame.length > 0 ? std::to_string(frame.length) : "");
  if (frame.fd) out += "#" + std::to_string(frame.fd_flags);
  for (const std::uint8_t byte : frame.data()) {
    std::snprintf(text, sizeof text, "%02X", byte);
    out += text;
  }
  return out;
}

}  // namespace seastitch
