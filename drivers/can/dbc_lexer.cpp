#include "drivers/can/dbc_lexer.hpp"

#include <stdexcept>

namespace seastitch {
namespace {

bool IsWordStart(char c) { return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

}  // namespace

DbcToken DbcLexer::Next() {
  SkipSpace();
  DbcToken token{DbcToken::Kind::kEnd, {}, line_, at_ == line_start_};
  if (at_ == text_.size()) return token;
  const std::size_t begin = at_;
  const char c = text_[at_];
  if (IsWordStart(c)) {
    token.kind = DbcToken::Kind::kWord;
    while (at_ < text_.size() && (IsWordStart(text_[at_]) || IsDigit(text_[at_]))) ++at_;
  } else if (BeginsNumber()) {
    token.kind = DbcToken::Kind::kNumber;
    SkipNumber();
  } else if (c == '"') {
    token.kind = DbcToken::Kind::kText;
    SkipText(token.line);
    token.text = text_.substr(begin + 1, at_ - begin - 2);
    return token;
  } else {
    token.kind = DbcToken::Kind::kSign;
    ++at_;
  }
  token.text = text_.substr(begin, at_ - begin);
  return token;
}

void DbcLexer::Fail(int line, const std::string& reason) const {
  throw std::runtime_error(file_ + ":" + std::to_string(line) + ": " + reason);
}

void DbcLexer::SkipSpace() {
  while (at_ < text_.size() && IsSpace(text_[at_])) Step();
}

void DbcLexer::Step() {
  if (text_[at_++] == '\n') {
    ++line_;
    line_start_ = at_;
  }
}

bool DbcLexer::BeginsNumber() const {
  const char c = text_[at_];
  if (IsDigit(c)) return true;
  if (c != '-' && c != '+' && c != '.') return false;
  const std::size_t next = at_ + 1;
  return next < text_.size() && (IsDigit(text_[next]) || (c != '.' && text_[next] == '.'));
}

void DbcLexer::SkipNumber() {
  ++at_;
  while (at_ < text_.size()) {
    const char c = text_[at_];
    const bool exponent_sign =
        (c == '-' || c == '+') && (text_[at_ - 1] == 'e' || text_[at_ - 1] == 'E');
    const bool exponent =
        (c == 'e' || c == 'E') && at_ + 1 < text_.size() &&
        (IsDigit(text_[at_ + 1]) || text_[at_ + 1] == '-' || text_[at_ + 1] == '+');
    if (!IsDigit(c) && c != '.' && !exponent && !exponent_sign) return;
    ++at_;
  }
}

void DbcLexer::SkipText(int line) {
  ++at_;
  while (at_ < text_.size() && text_[at_] != '"') {
    if (text_[at_] == '\\' && at_ + 1 < text_.size()) Step();
    Step();
  }
  if (at_ >= text_.size()) Fail(line, "text without an end");
  ++at_;
}

}  // namespace seastitch
