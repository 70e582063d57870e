#include "drivers/can/dbc_parser.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "drivers/can/dbc_lexer.hpp"

namespace seastitch {
namespace {

constexpr std::uint32_t kNoMessageId = 0xC0000000;  // message id of signals without a message
constexpr int kMaxMessageBytes = 64;
constexpr int kMaxNesting = 16;  // limit of switches inside switches

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

class DbcParser {
 public:
  DbcParser(std::string_view text, const std::string& file) : lexer_(text, file) { Advance(); }

  std::vector<DbcMessage> Parse() {
    while (token_.kind != DbcToken::Kind::kEnd) Statement();
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
    if (token_.kind != DbcToken::Kind::kWord) Fail("expected a statement");
    const DbcToken keyword = Take();
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
      if (token_.kind == DbcToken::Kind::kNumber)
        ValueTexts();
      else
        SkipStatement(keyword.line);
    } else if (keyword.text == "VAL_TABLE_") {
      Word("the table's name");
      ReadTexts();
    } else if (keyword.text == "NS_" || keyword.text == "BS_" || keyword.text == "BU_" ||
               keyword.text == "VERSION") {
      while (token_.kind != DbcToken::Kind::kEnd && !token_.begins_line) Advance();
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
    while (token_.kind == DbcToken::Kind::kWord && token_.text == "SG_") {
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
    if (token_.kind != DbcToken::Kind::kText) Fail("expected the unit");
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
    if (token_.kind != DbcToken::Kind::kWord) return;
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
    if (token_.kind == DbcToken::Kind::kNumber && token_.text.starts_with('-'))
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
    while (token_.kind == DbcToken::Kind::kNumber) {
      const double value = Number("a value");
      if (token_.kind != DbcToken::Kind::kText) Fail("expected the text of the value");
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
      if (signal.BytesNeeded() > message.length)
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
    if (token_.kind != DbcToken::Kind::kWord) Fail(std::string("expected ") + what);
    return std::string(Take().text);
  }

  std::uint64_t Whole(const char* what, std::uint64_t highest) {
    std::uint64_t value = 0;
    const char* const end = token_.text.data() + token_.text.size();
    const auto [stop, error] = std::from_chars(token_.text.data(), end, value);
    if (token_.kind != DbcToken::Kind::kNumber || error != std::errc() || stop != end ||
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
    if (token_.kind != DbcToken::Kind::kNumber || error != std::errc() ||
        stop != text.data() + text.size())
      Fail(std::string("expected ") + what + ", a number");
    Advance();
    return value;
  }

  void Expect(std::string_view sign) {
    if (token_.kind != DbcToken::Kind::kSign || token_.text != sign)
      Fail("expected '" + std::string(sign) + "'");
    Advance();
  }

  void SkipStatement(int line) {
    while (token_.text != ";" || token_.kind != DbcToken::Kind::kSign) {
      if (token_.kind == DbcToken::Kind::kEnd) lexer_.Fail(line, "statement without ';'");
      Advance();
    }
    Advance();
  }

  [[noreturn]] void Fail(const std::string& reason) const {
    const std::string found = token_.kind == DbcToken::Kind::kEnd
                                  ? "the end of the file"
                                  : "'" + std::string(token_.text.substr(0, 40)) + "'";
    lexer_.Fail(token_.line, reason + ", found " + found);
  }

  void Advance() { token_ = lexer_.Next(); }
  DbcToken Take() {
    const DbcToken taken = token_;
    Advance();
    return taken;
  }

  DbcLexer lexer_;
  DbcToken token_;
  std::vector<DbcMessage> messages_;
  std::set<std::uint32_t> ids_;
  std::set<std::string> names_;
  std::map<std::string, int> lines_;  // line of each MESSAGE.SIGNAL
};

}  // namespace

std::vector<DbcMessage> ParseDbc(std::string_view text, const std::string& file) {
  return DbcParser(text, file).Parse();
}

}  // namespace seastitch
