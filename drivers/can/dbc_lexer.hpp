#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace seastitch {

struct DbcToken {
  enum class Kind : std::uint8_t { kEnd, kWord, kNumber, kText, kSign };
  Kind kind = Kind::kEnd;
  std::string_view text;  // of the file; kText: without the quotation marks
  int line = 0;
  bool begins_line = false;  // true if no space precedes it in its line
};

// Splits the text of a DBC file into words, numbers, texts in quotation marks, and signs of one
// character. Keeps references to the text and the file's name, which must outlive it.
class DbcLexer {
 public:
  DbcLexer(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  // kEnd at the end of the text. Throws as Fail() for a text without a closing quotation mark.
  DbcToken Next();
  // Throws std::runtime_error "FILE:LINE: reason".
  [[noreturn]] void Fail(int line, const std::string& reason) const;

 private:
  void SkipSpace();
  void Step();
  bool BeginsNumber() const;
  void SkipNumber();
  void SkipText(int line);

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  int line_ = 1;
};

}  // namespace seastitch
