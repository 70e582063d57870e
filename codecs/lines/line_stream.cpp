#include "codecs/lines/line_stream.hpp"

#include <utility>

namespace seastitch {

std::vector<LineStream::Line> LineStream::Add(Bytes piece, Time recv) {
  std::vector<Line> lines;
  for (const std::uint8_t byte : piece) {
    const char c = static_cast<char>(byte);
    if (c == '\r' || c == '\n') {
      End(&lines);
      continue;
    }
    if (c == '$') End(&lines);
    if (open_.text.empty()) open_.recv = recv;
    open_.text.push_back(c);
    if (IsWholeSentence()) End(&lines);
    if (open_.text.size() < kLongest) continue;
    too_long_bytes_ += static_cast<std::int64_t>(open_.text.size());
    open_.text.clear();
  }
  return lines;
}

bool LineStream::IsWholeSentence() const {
  const std::string& text = open_.text;
  return text.size() > 3 && text.front() == '$' && text[text.size() - 3] == '*';
}

void LineStream::End(std::vector<Line>* lines) {
  if (!open_.text.empty()) lines->push_back(std::move(open_));
  open_ = {};
}

}  // namespace seastitch
