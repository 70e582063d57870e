#include "drivers/can/dbc.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <utility>

namespace seastitch {
namespace {

constexpr std::uint32_t kNoMessageId = 0xC0000000;  // message id of signals without a message
constexpr int kMaxMessageBytes = 64;
constexpr int kMaxNesting = 16;  // limit of switches inside switches

// Number of the next bit of a signal: an Intel signal is read from its least significant bit, a
// Motorola signal from its most significant one. Numbering: DbcSignal::start_bit.
int NextBit(int bit, bool motorola) {
  if (!motorola) return bit + 1;
  return bit % 8 == 0 ? bit + 15 : bit - 1;
}

// Number of bytes up to and including the last one that the signal uses.
int BytesNeeded(const DbcSignal& signal) {
  if (!signal.motorola) return (signal.start_bit + signal.length + 7) / 8;
  const int beyond_first_byte = signal.length - (signal.start_bit % 8 + 1);
  return signal.start_bit / 8 + 1 + (std::max(beyond_first_byte, 0) + 7) / 8;
}

std::uint64_t Mask(int length) { return length >= 64 ? ~0ULL : (1ULL << length) - 1; }

std::int64_t SignExtend(std::uint64_t bits, int length) {
  const std::uint64_t sign = 1ULL << (length - 1);
  return static_cast<std::int64_t>((bits ^ sign) - sign);
}

struct RawRange {
  double lowest;
  // first value above the range; the highest value itself may not be exact in double
  double beyond;
};

RawRange RangeOf(const DbcSignal& signal) {
  if (signal.kind == DbcSignal::Kind::kSigned)
    return {-std::ldexp(1.0, signal.length - 1), std::ldexp(1.0, signal.length - 1)};
  return {0.0, std::ldexp(1.0, signal.length)};
}

std::uint64_t IntegerBits(const DbcSignal& signal, double raw) {
  if (signal.kind == DbcSignal::Kind::kSigned)
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(raw)) & Mask(signal.length);
  return static_cast<std::uint64_t>(raw);
}

std::uint64_t FloatBits(const DbcSignal& signal, double raw) {
  return signal.kind == DbcSignal::Kind::kFloat32
             ? std::bit_cast<std::uint32_t>(static_cast<float>(raw))
             : std::bit_cast<std::uint64_t>(raw);
}

bool IsFloat(const DbcSignal& signal) {
  return signal.kind == DbcSignal::Kind::kFloat32 || signal.kind == DbcSignal::Kind::kFloat64;
}

bool IsUtf8(std::string_view text) {
  std::size_t following = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (following > 0) {
      if ((byte & 0xC0) != 0x80) return false;
      --following;
    } else if (byte >= 0x80) {
      following = byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : 1;
      if (byte < 0xC2 || byte > 0xF4) return false;
    }
  }
  return following == 0;
}

void AppendUtf8(char32_t point, std::string* out) {
  if (point < 0x800) {
    *out += static_cast<char>(0xC0 | (point >> 6));
  } else {
    *out += static_cast<char>(0xE0 | (point >> 12));
    *out += static_cast<char>(0x80 | ((point >> 6) & 0x3F));
  }
  *out += static_cast<char>(0x80 | (point & 0x3F));
}

// Text as UTF-8. Text that is not valid UTF-8 is taken as Windows-1252.
std::string ToUtf8(std::string_view text) {
  if (IsUtf8(text)) return std::string(text);
  // 0x80 to 0x9F, the codes that differ from Latin-1. Undefined codes become U+FFFD.
  constexpr char32_t kWindows[32] = {
      0x20AC, 0xFFFD, 0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
      0x2039, 0x0152, 0xFFFD, 0x017D, 0xFFFD, 0xFFFD, 0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
      0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0xFFFD, 0x017E, 0x0178};
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80)
      out += c;
    else
      AppendUtf8(byte < 0xA0 ? kWindows[byte - 0x80] : byte, &out);
  }
  return out;
}

struct Token {
  enum class Kind : std::uint8_t { kEnd, kWord, kNumber, kText, kSign };
  Kind kind = Kind::kEnd;
  std::string_view text;
  int line = 0;
  bool begins_line = false;  // true if no space precedes it in its line
};

bool IsWordStart(char c) { return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

class Lexer {
 public:
  Lexer(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  Token Next() {
    SkipSpace();
    Token token{Token::Kind::kEnd, {}, line_, at_ == line_start_};
    if (at_ == text_.size()) return token;
    const std::size_t begin = at_;
    const char c = text_[at_];
    if (IsWordStart(c)) {
      token.kind = Token::Kind::kWord;
      while (at_ < text_.size() && (IsWordStart(text_[at_]) || IsDigit(text_[at_]))) ++at_;
    } else if (BeginsNumber()) {
      token.kind = Token::Kind::kNumber;
      SkipNumber();
    } else if (c == '"') {
      token.kind = Token::Kind::kText;
      SkipText(token.line);
      token.text = text_.substr(begin + 1, at_ - begin - 2);
      return token;
    } else {
      token.kind = Token::Kind::kSign;
      ++at_;
    }
    token.text = text_.substr(begin, at_ - begin);
    return token;
  }

  [[noreturn]] void Fail(int line, const std::string& reason) const {
    throw std::runtime_error(file_ + ":" + std::to_string(line) + ": " + reason);
  }

 private:
  void SkipSpace() {
    while (at_ < text_.size() && IsSpace(text_[at_])) Step();
  }
  void Step() {
    if (text_[at_++] == '\n') {
      ++line_;
      line_start_ = at_;
    }
  }
  bool BeginsNumber() const {
    const char c = text_[at_];
    if (IsDigit(c)) return true;
    if (c != '-' && c != '+' && c != '.') return false;
    const std::size_t next = at_ + 1;
    return next < text_.size() && (IsDigit(text_[next]) || (c != '.' && text_[next] == '.'));
  }
  void SkipNumber() {
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
  void SkipText(int line) {
    ++at_;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) Step();
      Step();
    }
    if (at_ >= text_.size()) Fail(line, "text without an end");
    ++at_;
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  int line_ = 1;
};

class Parser {
 public:
  Parser(std::string_view text, const std::string& file) : lexer_(text, file) { Advance(); }

  std::vector<DbcMessage> Parse() {
    while (token_.kind != Token::Kind::kEnd) Statement();
    for (DbcMessage& message : messages_) {
      CheckLengths(message);
      FindSwitches(&message);
    }
    return std::move(messages_);
  }

 private:
  struct SignalName {
    int line;
    std::uint32_t message;
    std::string signal;
  };

  void Statement() {
    if (token_.kind != Token::Kind::kWord) Fail("expected a statement");
    const Token keyword = Take();
    if (keyword.text == "BO_") {
      Message();
    } else if (keyword.text == "SG_") {
      Fail("SG_ outside a message");
    } else if (keyword.text == "SIG_VALTYPE_") {
      ValueType();
    } else if (keyword.text == "SG_MUL_VAL_") {
      SwitchRanges();
    } else if (keyword.text == "VAL_") {
      // A signal's values begin with a number, an environment variable's with a name.
      if (token_.kind == Token::Kind::kNumber)
        ValueTexts();
      else
        SkipStatement(keyword.line);
    } else if (keyword.text == "VAL_TABLE_") {
      Word("the table's name");
      ReadTexts();
    } else if (keyword.text == "NS_" || keyword.text == "BS_" || keyword.text == "BU_" ||
               keyword.text == "VERSION") {
      while (token_.kind != Token::Kind::kEnd && !token_.begins_line) Advance();
    } else {
      SkipStatement(keyword.line);
    }
  }

  void Message() {
    const int line = token_.line;
    const std::uint32_t id_word = MessageId();
    DbcMessage message;
    message.extended = (id_word & kCanExtended) != 0;
    message.id = id_word & ~kCanExtended;
    message.name = Word("the message's name");
    Expect(":");
    message.length = static_cast<int>(Whole("the message's length", kMaxMessageBytes));
    Word("the message's sender");
    while (token_.kind == Token::Kind::kWord && token_.text == "SG_") {
      Advance();
      Signal(&message);
    }
    if (id_word == kNoMessageId) return;
    if (message.id > (message.extended ? 0x1FFFFFFFU : 0x7FFU))
      lexer_.Fail(line, "message id " + std::to_string(id_word) + " does not exist on a bus");
    if (!ids_.insert(id_word).second)
      lexer_.Fail(line, "message id " + std::to_string(id_word) + " stands twice");
    if (!names_.insert(message.name).second)
      lexer_.Fail(line, "message " + message.name + " stands twice");
    messages_.push_back(std::move(message));
  }

  void Signal(DbcMessage* message) {
    const int line = token_.line;
    DbcSignal signal;
    signal.name = Word("the signal's name");
    Multiplexing(&signal);
    Expect(":");
    Layout(&signal);
    Expect("(");
    signal.factor = Number("the factor");
    Expect(",");
    signal.offset = Number("the offset");
    Expect(")");
    if (signal.factor == 0.0) lexer_.Fail(line, "the factor of " + signal.name + " is 0");
    Expect("[");
    Number("the least value");
    Expect("|");
    Number("the greatest value");
    Expect("]");
    if (token_.kind != Token::Kind::kText) Fail("expected the unit");
    signal.unit = ToUtf8(Take().text);
    Word("a receiver");
    while (token_.text == ",") {
      Advance();
      Word("a receiver");
    }
    if (message->Find(signal.name) != nullptr)
      lexer_.Fail(line, "signal " + signal.name + " stands twice");
    lines_[message->name + "." + signal.name] = line;
    message->signals.push_back(std::move(signal));
  }

  // M: the signal is a switch. m<k>: it is present while the switch is k. m<k>M: both.
  void Multiplexing(DbcSignal* signal) {
    if (token_.kind != Token::Kind::kWord) return;
    std::string_view mark = Take().text;
    signal->is_switch = mark.ends_with('M');
    if (mark == "M") return;
    if (signal->is_switch) mark.remove_suffix(1);
    const char* const end = mark.data() + mark.size();
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(mark.data() + 1, end, value);
    if (mark.front() != 'm' || error != std::errc() || stop != end)
      Fail("expected M, m<number> or ':'");
    signal->switch_ranges = {{value, value}};
  }

  void Layout(DbcSignal* signal) {
    signal->start_bit = static_cast<int>(Whole("the start bit", 8 * kMaxMessageBytes - 1));
    Expect("|");
    signal->length = static_cast<int>(Whole("the length", 64));
    if (signal->length == 0) Fail("the length is 0");
    Expect("@");
    signal->motorola = Whole("the byte order", 1) == 0;
    if (token_.text != "+" && token_.text != "-") Fail("expected the sign, + or -");
    signal->kind = Take().text == "+" ? DbcSignal::Kind::kUnsigned : DbcSignal::Kind::kSigned;
  }

  void ValueType() {
    const SignalName name = NameOfSignal();
    if (token_.text == ":") Advance();
    const std::uint64_t type = Whole("the value type", 2);
    Expect(";");
    DbcSignal* const signal = FindSignal(name);
    if (signal == nullptr || type == 0) return;
    signal->kind = type == 1 ? DbcSignal::Kind::kFloat32 : DbcSignal::Kind::kFloat64;
    if (signal->length != (type == 1 ? 32 : 64))
      lexer_.Fail(name.line, "the length of float signal " + name.signal + " is wrong");
  }

  // SG_MUL_VAL_ id signal switch a-b, c-d;
  void SwitchRanges() {
    const SignalName name = NameOfSignal();
    const std::string switched_by = Word("the switch's name");
    std::vector<DbcSignal::Range> ranges;
    do {
      if (!ranges.empty()) Expect(",");
      const std::uint64_t first = Whole("the first value of a range", ~0ULL);
      ranges.push_back({first, EndOfRange()});
      if (ranges.back().last < first) lexer_.Fail(name.line, "a range that ends before it begins");
    } while (token_.text == ",");
    Expect(";");
    if (DbcSignal* const signal = FindSignal(name)) {
      signal->switched_by = switched_by;
      signal->switch_ranges = std::move(ranges);
    }
  }

  // "-5" as one token, or "-" and "5" as two.
  std::uint64_t EndOfRange() {
    if (token_.kind == Token::Kind::kNumber && token_.text.starts_with('-'))
      token_.text.remove_prefix(1);
    else
      Expect("-");
    return Whole("the last value of a range", ~0ULL);
  }

  void ValueTexts() {
    const SignalName name = NameOfSignal();
    std::map<std::int64_t, std::string> texts = ReadTexts();
    if (DbcSignal* const signal = FindSignal(name)) signal->value_texts = std::move(texts);
  }

  // Pairs of a value and its text, up to the end of the statement.
  std::map<std::int64_t, std::string> ReadTexts() {
    std::map<std::int64_t, std::string> texts;
    while (token_.kind == Token::Kind::kNumber) {
      const double value = Number("a value");
      if (token_.kind != Token::Kind::kText) Fail("expected the text of the value");
      // Values beyond 2^63 are ignored.
      if (std::abs(value) < 9.2e18) texts[static_cast<std::int64_t>(value)] = ToUtf8(token_.text);
      Advance();
    }
    Expect(";");
    return texts;
  }

  SignalName NameOfSignal() {
    const int line = token_.line;
    const std::uint32_t message = MessageId();
    return {line, message, Word("the signal's name")};
  }

  // The signal; null for signals without a message.
  DbcSignal* FindSignal(const SignalName& name) {
    if (name.message == kNoMessageId) return nullptr;
    for (DbcMessage& message : messages_)
      if ((message.id | (message.extended ? kCanExtended : 0)) == name.message)
        for (DbcSignal& signal : message.signals)
          if (signal.name == name.signal) return &signal;
    lexer_.Fail(name.line, "no such signal: " + name.signal);
  }

  void CheckLengths(const DbcMessage& message) {
    for (const DbcSignal& signal : message.signals) {
      const int line = lines_[message.name + "." + signal.name];
      if (BytesNeeded(signal) > message.length)
        lexer_.Fail(line, "signal " + signal.name + " lies outside its message");
    }
  }

  // Sets the switch of every switched signal. If the file does not name it, the message must have
  // exactly one switch that is not switched itself.
  void FindSwitches(DbcMessage* message) {
    std::vector<std::string> roots;
    for (const DbcSignal& signal : message->signals)
      if (signal.is_switch && signal.switch_ranges.empty()) roots.push_back(signal.name);
    for (DbcSignal& signal : message->signals) {
      if (signal.switch_ranges.empty()) continue;
      const int line = lines_[message->name + "." + signal.name];
      if (signal.switched_by.empty()) {
        if (roots.empty()) lexer_.Fail(line, "signal " + signal.name + " has no switch");
        if (roots.size() > 1) lexer_.Fail(line, "message " + message->name + " has two switches");
        signal.switched_by = roots.front();
      }
      const DbcSignal* const by = message->Find(signal.switched_by);
      if (by == nullptr || !by->is_switch)
        lexer_.Fail(line, "signal " + signal.name + ": no such switch: " + signal.switched_by);
    }
    for (const DbcSignal& signal : message->signals) {
      int depth = 0;
      for (const DbcSignal* s = &signal; !s->switched_by.empty(); s = message->Find(s->switched_by))
        if (++depth > kMaxNesting)
          lexer_.Fail(lines_[message->name + "." + signal.name],
                      "signal " + signal.name + " is switched by itself, or through more than " +
                          std::to_string(kMaxNesting) + " switches");
    }
  }

  std::uint32_t MessageId() {
    return static_cast<std::uint32_t>(Whole("the message's id", 0xFFFFFFFF));
  }

  std::string Word(const char* what) {
    if (token_.kind != Token::Kind::kWord) Fail(std::string("expected ") + what);
    return std::string(Take().text);
  }

  std::uint64_t Whole(const char* what, std::uint64_t highest) {
    std::uint64_t value = 0;
    const char* const end = token_.text.data() + token_.text.size();
    const auto [stop, error] = std::from_chars(token_.text.data(), end, value);
    if (token_.kind != Token::Kind::kNumber || error != std::errc() || stop != end ||
        value > highest)
      Fail(std::string("expected ") + what + ", a whole number up to " + std::to_string(highest));
    Advance();
    return value;
  }

  double Number(const char* what) {
    std::string_view text = token_.text;
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (token_.kind != Token::Kind::kNumber || error != std::errc() ||
        stop != text.data() + text.size())
      Fail(std::string("expected ") + what + ", a number");
    Advance();
    return value;
  }

  void Expect(std::string_view sign) {
    if (token_.kind != Token::Kind::kSign || token_.text != sign)
      Fail("expected '" + std::string(sign) + "'");
    Advance();
  }

  void SkipStatement(int line) {
    while (token_.text != ";" || token_.kind != Token::Kind::kSign) {
      if (token_.kind == Token::Kind::kEnd) lexer_.Fail(line, "statement without ';'");
      Advance();
    }
    Advance();
  }

  [[noreturn]] void Fail(const std::string& reason) const {
    const std::string found = token_.kind == Token::Kind::kEnd
                                  ? "the end of the file"
                                  : "'" + std::string(token_.text.substr(0, 40)) + "'";
    lexer_.Fail(token_.line, reason + ", found " + found);
  }

  void Advance() { token_ = lexer_.Next(); }
  Token Take() {
    const Token taken = token_;
    Advance();
    return taken;
  }

  Lexer lexer_;
  Token token_;
  std::vector<DbcMessage> messages_;
  std::set<std::uint32_t> ids_;
  std::set<std::string> names_;
  std::map<std::string, int> lines_;  // line of each MESSAGE.SIGNAL
};

}  // namespace

std::optional<std::uint64_t> DbcSignal::Bits(Bytes data) const {
  if (static_cast<std::size_t>(BytesNeeded(*this)) > data.size()) return std::nullopt;
  std::uint64_t bits = 0;
  int bit = start_bit;
  for (int i = 0; i < length; ++i, bit = NextBit(bit, motorola)) {
    const std::uint64_t one = (data[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1U;
    bits |= one << (motorola ? length - 1 - i : i);
  }
  return bits;
}

void DbcSignal::Put(std::uint64_t bits, CanFrame* frame) const {
  int bit = start_bit;
  for (int i = 0; i < length; ++i, bit = NextBit(bit, motorola)) {
    const std::uint64_t one = (bits >> (motorola ? length - 1 - i : i)) & 1U;
    std::uint8_t& byte = frame->bytes[static_cast<std::size_t>(bit / 8)];
    byte = static_cast<std::uint8_t>((byte & ~(1U << (bit % 8))) | (one << (bit % 8)));
  }
}

double DbcSignal::Physical(std::uint64_t bits) const {
  double raw = 0.0;
  switch (kind) {
    case Kind::kUnsigned: raw = static_cast<double>(bits); break;
    case Kind::kSigned: raw = static_cast<double>(SignExtend(bits, length)); break;
    case Kind::kFloat32: raw = std::bit_cast<float>(static_cast<std::uint32_t>(bits)); break;
    case Kind::kFloat64: raw = std::bit_cast<double>(bits); break;
  }
  return raw * factor + offset;
}

std::string DbcSignal::ValueText(std::uint64_t bits) const {
  const std::int64_t raw =
      kind == Kind::kSigned ? SignExtend(bits, length) : static_cast<std::int64_t>(bits);
  const auto found = value_texts.find(raw);
  return found == value_texts.end() ? "" : found->second;
}

std::optional<std::uint64_t> DbcSignal::RawBits(double physical) const {
  const double raw = (physical - offset) / factor;
  if (IsFloat(*this)) return FloatBits(*this, raw);
  const double rounded = std::nearbyint(raw);
  const RawRange range = RangeOf(*this);
  if (!(rounded >= range.lowest && rounded < range.beyond)) return std::nullopt;
  return IntegerBits(*this, rounded);
}

std::uint64_t DbcSignal::SaturatedBits(double physical) const {
  if (const std::optional<std::uint64_t> bits = RawBits(physical)) return *bits;
  const double raw = (physical - offset) / factor;
  if (std::isnan(raw)) return 0;
  if (kind == Kind::kSigned) return raw < 0.0 ? 1ULL << (length - 1) : Mask(length - 1);
  return raw < 0.0 ? 0 : Mask(length);
}

const DbcSignal* DbcMessage::Find(std::string_view signal) const {
  for (const DbcSignal& candidate : signals)
    if (candidate.name == signal) return &candidate;
  return nullptr;
}

std::optional<bool> DbcMessage::IsThere(const DbcSignal& signal, Bytes data) const {
  if (signal.switched_by.empty()) return true;
  const DbcSignal& by = *Find(signal.switched_by);
  const std::optional<bool> switch_is_there = IsThere(by, data);
  if (switch_is_there != true) return switch_is_there;
  const std::optional<std::uint64_t> value = by.Bits(data);
  if (!value) return std::nullopt;
  return std::any_of(
      signal.switch_ranges.begin(), signal.switch_ranges.end(), [&value](const auto& range) {
        return range.first <= *value && *value <= range.last;
      });
}

SwitchPositions DbcMessage::SwitchesFor(const DbcSignal& signal) const {
  SwitchPositions positions;
  for (const DbcSignal* s = &signal; !s->switched_by.empty(); s = Find(s->switched_by))
    positions[s->switched_by] = s->switch_ranges.front().first;
  return positions;
}

CanFrame DbcMessage::MakeFrame() const {
  CanFrame frame;
  frame.id = id;
  frame.extended = extended;
  frame.fd = length > 8;
  frame.length = static_cast<std::uint8_t>(length);
  return frame;
}

Dbc Dbc::Load(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path))
    throw std::runtime_error(path + ":0: not a file that can be read");
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return Parse(text, path);
}

Dbc Dbc::Parse(std::string_view text, const std::string& file) {
  Dbc dbc;
  dbc.messages_ = Parser(text, file).Parse();
  for (std::size_t i = 0; i < dbc.messages_.size(); ++i)
    dbc.index_[{dbc.messages_[i].id, dbc.messages_[i].extended}] = i;
  return dbc;
}

std::optional<Dbc::Decoded> Dbc::Decode(const CanFrame& frame) const {
  const DbcMessage* const message =
      frame.remote || frame.error ? nullptr : Find(frame.id, frame.extended);
  if (message == nullptr) return std::nullopt;
  Decoded decoded{message, {}, {}};
  for (const DbcSignal& signal : message->signals) {
    const std::optional<bool> there = message->IsThere(signal, frame.data());
    if (there == false) continue;
    const std::optional<std::uint64_t> bits = there ? signal.Bits(frame.data()) : std::nullopt;
    if (bits)
      decoded.values.push_back({&signal, signal.Physical(*bits)});
    else
      decoded.missing.push_back(&signal);
  }
  return decoded;
}

CanFrame Dbc::Encode(const std::string& name, const std::map<std::string, double>& values) const {
  const DbcMessage* const message = Find(name);
  if (message == nullptr) throw std::runtime_error(name + ": no such message");
  CanFrame frame = message->MakeFrame();
  for (const auto& [signal_name, physical] : values) {
    const DbcSignal* const signal = message->Find(signal_name);
    if (signal == nullptr) throw std::runtime_error(name + "." + signal_name + ": no such signal");
    const std::optional<std::uint64_t> bits = signal->RawBits(physical);
    if (!bits)
      throw std::runtime_error(name + "." + signal_name + " cannot hold " +
                               std::to_string(physical));
    signal->Put(*bits, &frame);
    for (const auto& [name_of_switch, value] : message->SwitchesFor(*signal))
      if (!values.contains(name_of_switch)) message->Find(name_of_switch)->Put(value, &frame);
  }
  return frame;
}

const DbcMessage* Dbc::Find(std::uint32_t id, bool extended) const {
  const auto found = index_.find({id, extended});
  return found == index_.end() ? nullptr : &messages_[found->second];
}

const DbcMessage* Dbc::Find(std::string_view message) const {
  for (const DbcMessage& candidate : messages_)
    if (candidate.name == message) return &candidate;
  return nullptr;
}

}  // namespace seastitch
