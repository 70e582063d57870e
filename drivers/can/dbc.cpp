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

constexpr std::uint32_t kNoMessageId = 0xC0000000;  // holds signals that belong to no message
constexpr int kMaxMessageBytes = 64;

// Where the walk from the first to the last bit of a signal stands; see the note on numbering at
// DbcSignal::start_bit. Intel walks from the least significant bit, Motorola from the most.
int NextBit(int bit, bool motorola) {
  if (!motorola) return bit + 1;
  return bit % 8 == 0 ? bit + 15 : bit - 1;
}

// The byte after the last one that the signal touches.
int BytesNeeded(const DbcSignal& signal) {
  int last = 0;
  int bit = signal.start_bit;
  for (int i = 0; i < signal.length; ++i, bit = NextBit(bit, signal.motorola))
    last = std::max(last, bit / 8);
  return last + 1;
}

std::uint64_t Mask(int length) { return length >= 64 ? ~0ULL : (1ULL << length) - 1; }

std::int64_t SignExtend(std::uint64_t bits, int length) {
  const std::uint64_t sign = 1ULL << (length - 1);
  return static_cast<std::int64_t>((bits ^ sign) - sign);
}

struct RawRange {
  double lowest;
  double beyond;  // first value above the range: exact in double, the highest one may not be
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

struct Token {
  enum class Kind : std::uint8_t { kEnd, kWord, kNumber, kText, kSign };
  Kind kind = Kind::kEnd;
  std::string_view text;
  int line = 0;
  bool begins_line = false;  // without any space before it
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
    for (const auto& [line, message, signal] : not_simple_) Remove(line, message, signal);
    for (const DbcMessage& message : messages_) CheckLengths(message);
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
      not_simple_.push_back(NameOfSignal());
      SkipStatement(keyword.line);
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
    const bool simple = Multiplexing(&signal);
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
    signal.unit = std::string(Take().text);
    Word("a receiver");
    while (token_.text == ",") {
      Advance();
      Word("a receiver");
    }
    if (message->Find(signal.name) != nullptr)
      lexer_.Fail(line, "signal " + signal.name + " stands twice");
    if (signal.multiplex == DbcSignal::Multiplex::kSwitch && message->multiplex_switch() != nullptr)
      lexer_.Fail(line, "message " + message->name + " has two switches");
    lines_[message->name + "." + signal.name] = line;
    if (simple) message->signals.push_back(std::move(signal));
  }

  // False for a switch that is itself switched.
  bool Multiplexing(DbcSignal* signal) {
    if (token_.kind != Token::Kind::kWord) return true;
    std::string_view mark = Take().text;
    if (mark == "M") {
      signal->multiplex = DbcSignal::Multiplex::kSwitch;
      return true;
    }
    const bool nested = mark.ends_with('M');
    if (nested) mark.remove_suffix(1);
    const char* const end = mark.data() + mark.size();
    const auto [stop, error] = std::from_chars(mark.data() + 1, end, signal->multiplex_value);
    if (mark.front() != 'm' || error != std::errc() || stop != end)
      Fail("expected M, m<number> or ':'");
    signal->multiplex = DbcSignal::Multiplex::kSwitched;
    return !nested;
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
    if (signal == nullptr) lexer_.Fail(name.line, "no such signal: " + name.signal);
    if (type == 0) return;
    signal->kind = type == 1 ? DbcSignal::Kind::kFloat32 : DbcSignal::Kind::kFloat64;
    if (signal->length != (type == 1 ? 32 : 64))
      lexer_.Fail(name.line, "the length of float signal " + name.signal + " is wrong");
  }

  SignalName NameOfSignal() {
    const int line = token_.line;
    const std::uint32_t message = MessageId();
    return {line, message, Word("the signal's name")};
  }

  DbcMessage* FindMessage(std::uint32_t id_word) {
    for (DbcMessage& message : messages_)
      if ((message.id | (message.extended ? kCanExtended : 0)) == id_word) return &message;
    return nullptr;
  }

  DbcSignal* FindSignal(const SignalName& name) {
    DbcMessage* const message = FindMessage(name.message);
    if (message == nullptr) return nullptr;
    for (DbcSignal& signal : message->signals)
      if (signal.name == name.signal) return &signal;
    return nullptr;
  }

  // Signals under ranges of a switch are not read as if they had one value.
  void Remove(int line, std::uint32_t id_word, const std::string& signal) {
    DbcMessage* const message = FindMessage(id_word);
    if (message == nullptr) lexer_.Fail(line, "no such message: " + std::to_string(id_word));
    std::erase_if(message->signals, [&](const DbcSignal& s) { return s.name == signal; });
  }

  void CheckLengths(const DbcMessage& message) {
    for (const DbcSignal& signal : message.signals) {
      const int line = lines_[message.name + "." + signal.name];
      if (BytesNeeded(signal) > message.length)
        lexer_.Fail(line, "signal " + signal.name + " lies outside its message");
      if (signal.multiplex == DbcSignal::Multiplex::kSwitched &&
          message.multiplex_switch() == nullptr)
        lexer_.Fail(line, "signal " + signal.name + " has no switch");
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
  std::map<std::string, int> lines_;  // of each MESSAGE.SIGNAL
  std::vector<SignalName> not_simple_;
};

bool IsThere(const DbcMessage& message, const DbcSignal& signal, Bytes data) {
  if (signal.multiplex != DbcSignal::Multiplex::kSwitched) return true;
  const std::optional<std::uint64_t> mode = message.multiplex_switch()->Bits(data);
  return mode && *mode == signal.multiplex_value;
}

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

const DbcSignal* DbcMessage::multiplex_switch() const {
  for (const DbcSignal& candidate : signals)
    if (candidate.multiplex == DbcSignal::Multiplex::kSwitch) return &candidate;
  return nullptr;
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
    if (!IsThere(*message, signal, frame.data())) continue;
    if (const std::optional<std::uint64_t> bits = signal.Bits(frame.data()))
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
    if (signal->multiplex == DbcSignal::Multiplex::kSwitched)
      message->multiplex_switch()->Put(signal->multiplex_value, &frame);
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
