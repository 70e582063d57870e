#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace seastitch {

// Largest number of bytes of a UTF-8 text, at most max_bytes, at which the text can be cut without
// cutting a character. max_bytes, or the text's size, where the text is not UTF-8.
inline std::size_t WholeCharacters(std::string_view text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return text.size();
  constexpr std::size_t kLongestCharacter = 4;
  for (std::size_t back = 0; back < kLongestCharacter && back < max_bytes; ++back) {
    const std::size_t end = max_bytes - back;
    if ((static_cast<unsigned char>(text[end]) & 0xC0) != 0x80) return end;
  }
  return max_bytes;
}

// Text from other processes without control characters, for people.
inline std::string Printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  return text;
}

}  // namespace seastitch
