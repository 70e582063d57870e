#include "codecs/lines/text_table.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxLine = 4096;
constexpr std::array kOfTime{
    "epoch", "year", "month", "day", "hour", "minute", "second", "date", "clock", "iso"};

bool IsTimeText(std::string_view quantity) {
  return quantity == "date" || quantity == "clock" || quantity == "iso";
}

// Three numbers: with a separator between them, or the first two of so many digits and the rest.
// Nothing for any other text.
std::optional<std::array<double, 3>> Triple(std::string_view text,
                                            char separator,
                                            std::size_t first_digits) {
  std::vector<std::string_view> parts = Split(text, separator);
  if (parts.size() == 1 && text.size() >= first_digits + 4)
    parts = {
        text.substr(0, first_digits), text.substr(first_digits, 2), text.substr(first_digits + 2)};
  if (parts.size() != 3) return std::nullopt;
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = ParseNumber(parts[i]);
    if (!number) return std::nullopt;
    out[i] = *number;
  }
  return out;
}

// Takes an offset from UTC, such as +02:00, -0330 or +01, from the end of a clock. [s]; 0: none.
std::optional<double> TakeOffset(std::string_view* clock) {
  if (clock->ends_with('Z')) {
    clock->remove_suffix(1);
    return 0.0;
  }
  const std::size_t at = clock->find_last_of("+-");
  if (at == std::string_view::npos) return 0.0;
  std::string digits;
  for (const char c : clock->substr(at + 1))
    if (c != ':') digits += c;
  const double sign = (*clock)[at] == '-' ? -1.0 : 1.0;
  clock->remove_suffix(clock->size() - at);
  if (digits.size() != 2 && digits.size() != 4) return std::nullopt;
  const auto hours = ParseNumber(std::string_view(digits).substr(0, 2));
  const auto minutes =
      digits.size() == 2 ? std::optional(0.0) : ParseNumber(std::string_view(digits).substr(2));
  if (!hours || !minutes || *hours > 14.0 || *minutes >= 60.0) return std::nullopt;
  return sign * (*hours * 3600.0 + *minutes * 60.0);
}

// Date or clock as numbers; false for any other text.
bool ReadTimeText(const std::string& quantity, std::string_view text, TextNumbers* numbers) {
  if (quantity == "iso") {
    const std::size_t split = text.find_first_of("T ");
    if (split == std::string_view::npos) return false;
    std::string_view clock = text.substr(split + 1);
    const auto offset_s = TakeOffset(&clock);
    if (!offset_s) return false;
    (*numbers)["utc_offset"] = *offset_s;
    return ReadTimeText("date", text.substr(0, split), numbers) &&
           ReadTimeText("clock", clock, numbers);
  }
  const bool date = quantity == "date";
  const auto parts = date ? Triple(text, '-', 4) : Triple(text, ':', 2);
  if (!parts) return false;
  constexpr std::array kDate{"year", "month", "day"};
  constexpr std::array kClock{"hour", "minute", "second"};
  for (std::size_t i = 0; i < 3; ++i) (*numbers)[date ? kDate[i] : kClock[i]] = (*parts)[i];
  return true;
}

// Degrees, or degrees and minutes, or with seconds, with N, S, E or W at either end: "33.5S",
// "27 45.6 N", "27d45'36\"N". [deg]
std::optional<double> ParseAngle(std::string_view text, std::string_view hemispheres) {
  if (const auto number = ParseNumber(text)) return number;
  const auto upper = [](char c) { return static_cast<char>(c & ~0x20); };
  // In 33d30m36s the last letter is that of the seconds.
  const bool has_marks = text.find_first_of("dm") != std::string_view::npos;
  double sign = 1.0;
  bool has_letter = false;
  for (const bool at_end : {true, false}) {
    if (text.empty() || has_letter) break;
    const char c = upper(at_end ? text.back() : text.front());
    if (hemispheres.find(c) == std::string_view::npos) continue;
    if (at_end && has_marks && text.back() == 's') continue;
    has_letter = true;
    sign = c == 'S' || c == 'W' ? -1.0 : 1.0;
    at_end ? text.remove_suffix(1) : text.remove_prefix(1);
  }
  text = Trimmed(text);
  if (!has_letter && text.starts_with('-')) {
    sign = -1.0;
    text.remove_prefix(1);
  }
  std::string plain(text);
  for (char& c : plain) {
    const bool is_letter = std::isalpha(static_cast<unsigned char>(c)) != 0;
    if (c == '-' || (is_letter && c != 'd' && c != 'm' && c != 's')) return std::nullopt;
    if (c != '.' && (c < '0' || c > '9')) c = ' ';
  }
  const std::vector<std::string_view> parts = TextColumns(plain, ' ');
  if (parts.empty() || parts.size() > 3) return std::nullopt;
  double degrees = 0.0, unit = 1.0;
  for (std::size_t i = 0; i < parts.size(); ++i, unit /= 60.0) {
    const auto number = ParseNumber(parts[i]);
    if (!number || (i > 0 && *number >= 60.0)) return std::nullopt;
    degrees += *number * unit;
  }
  return sign * degrees;
}

std::string WithPoint(std::string_view text, char delimiter) {
  std::string with_point(text);
  if (delimiter != ',' && text.find('.') == std::string_view::npos)
    std::replace(with_point.begin(), with_point.end(), ',', '.');
  return with_point;
}

std::optional<double> ReadNumber(const std::string& quantity, std::string_view text) {
  if (quantity == "latitude") return ParseAngle(text, "NS");
  if (quantity == "longitude") return ParseAngle(text, "EW");
  return ParseNumber(text);
}

// What a column should hold, for people.
const char* FormOf(const std::string& quantity) {
  if (quantity == "iso") return "a time such as 2026-05-02T10:20:30.5Z";
  if (quantity == "date") return "a date such as 2026-05-02";
  if (quantity == "clock") return "a time such as 10:20:30.5";
  if (quantity == "latitude") return "degrees such as 27.76 or 27 45.6 N";
  if (quantity == "longitude") return "degrees such as -82.63 or 82 37.8 W";
  return "a number such as 12.5";
}

}  // namespace

std::vector<std::string_view> TextColumns(std::string_view line, char delimiter) {
  const auto is_delimiter = [delimiter](char c) {
    return c == delimiter || (delimiter == ' ' && c == '\t');
  };
  const auto end_of = [&](std::size_t at) {
    while (at < line.size() && !is_delimiter(line[at])) ++at;
    return at;
  };
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    // A field in quotation marks ends at a mark before a delimiter or the end; any other mark is
    // text.
    std::size_t text = begin;
    while (text < line.size() && line[text] == ' ' && delimiter != ' ') ++text;
    std::size_t mark =
        text < line.size() && line[text] == '"' ? line.find('"', text + 1) : std::string_view::npos;
    const auto closes = [&](std::size_t at) {
      do ++at;
      while (at < line.size() && line[at] == ' ' && !is_delimiter(line[at]));
      return at == line.size() || is_delimiter(line[at]);
    };
    while (mark != std::string_view::npos && !closes(mark)) mark = line.find('"', mark + 1);
    if (mark != std::string_view::npos) {
      fields.push_back(line.substr(text + 1, mark - text - 1));
      begin = end_of(mark + 1) + 1;
      continue;
    }
    const std::size_t end = end_of(begin);
    if (delimiter != ' ' || end > begin) fields.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return fields;
}

std::optional<double> Find(const TextNumbers& numbers, std::string_view quantity) {
  const auto found = numbers.find(quantity);
  return found == numbers.end() ? std::nullopt : std::optional(found->second);
}

std::optional<TextNumbers> ReadTextRow(std::string_view line,
                                       char delimiter,
                                       const std::vector<TextColumn>& columns,
                                       std::string* problem) {
  const std::vector<std::string_view> fields = TextColumns(line, delimiter);
  TextNumbers numbers;
  for (const TextColumn& column : columns) {
    const std::string_view stated =
        column.column < fields.size() ? Trimmed(fields[column.column]) : std::string_view();
    if (stated.empty()) continue;
    const std::string text = WithPoint(stated, delimiter);
    bool is_read = false;
    if (IsTimeText(column.quantity)) {
      is_read = ReadTimeText(column.quantity, text, &numbers);
    } else if (const auto number = ReadNumber(column.quantity, text)) {
      is_read = std::abs(*number * column.scale) < 1e12;
      numbers[column.quantity] = *number * column.scale;
    }
    if (is_read) continue;
    if (problem != nullptr)
      *problem = "column " + std::to_string(column.column + 1) + " holds '" +
                 std::string(stated.substr(0, 40)) + "', expected " + FormOf(column.quantity);
    return std::nullopt;
  }
  return numbers;
}

std::optional<Time> TimeOf(const TextNumbers& n) {
  if (const auto epoch_s = Find(n, "epoch"))
    return *epoch_s >= 0.0 && *epoch_s < 1e10 ? std::optional(Time(FromSeconds(*epoch_s)))
                                              : std::nullopt;
  const auto whole = [&n](std::string_view name) {
    const double value = Find(n, name).value_or(-1.0);
    return value >= 0.0 && value < 1e4 && value == std::floor(value) ? static_cast<int>(value) : -1;
  };
  const auto midnight = Midnight(whole("year"), whole("month"), whole("day"));
  const int hour = whole("hour");
  const int minute = whole("minute");
  const double second = Find(n, "second").value_or(-1.0);
  if (!midnight || hour < 0 || hour > 23 || minute < 0 || minute > 59 ||
      !(second >= 0.0 && second < 61.0))
    return std::nullopt;
  return *midnight + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         FromSeconds(second - Find(n, "utc_offset").value_or(0.0));
}

std::string ProblemWith(const std::vector<TextColumn>& columns,
                        const std::vector<std::string>& quantities) {
  std::map<std::string, int> given;
  for (const TextColumn& column : columns) {
    if (std::find(kOfTime.begin(), kOfTime.end(), column.quantity) == kOfTime.end() &&
        std::find(quantities.begin(), quantities.end(), column.quantity) == quantities.end())
      return "'" + column.quantity + "' is no quantity of a column";
    if (!std::isfinite(column.scale) || column.scale == 0.0)
      return column.quantity + ": scale must not be 0";
    if (++given[column.quantity] > 1) return column.quantity + " stands in two columns";
  }
  return "";
}

bool HasColumns(const std::vector<TextColumn>& columns,
                const std::vector<std::string>& quantities) {
  return std::all_of(quantities.begin(), quantities.end(), [&](const std::string& quantity) {
    return std::any_of(columns.begin(), columns.end(), [&](const TextColumn& column) {
      return column.quantity == quantity;
    });
  });
}

TimeColumns TimeColumnsAmong(const std::vector<TextColumn>& columns) {
  const auto all = [&columns](const std::vector<std::string>& quantities) {
    return HasColumns(columns, quantities);
  };
  const bool date = all({"date"}) || all({"year", "month", "day"});
  const bool clock = all({"clock"}) || all({"hour", "minute", "second"});
  if (all({"epoch"}) || all({"iso"}) || (date && clock)) return TimeColumns::kWhole;
  const bool any = std::any_of(
      kOfTime.begin(), kOfTime.end(), [&all](const char* quantity) { return all({quantity}); });
  return any ? TimeColumns::kPart : TimeColumns::kNone;
}

SurveyReader::Look TextLineReader::LookAt(Bytes bytes, bool at_end) const {
  const Bytes line = bytes.first(std::min(bytes.size(), kMaxLine));
  const auto end = std::find(line.begin(), line.end(), '\n');
  if (end != line.end()) return Record(static_cast<std::size_t>(end - line.begin()) + 1);
  if (line.size() == kMaxLine) return Damage(kMaxLine);
  return at_end ? Record(bytes.size()) : TooShort();
}

void TextLineReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  const std::string text(record.begin(), record.end());
  ReadLine(Trimmed(text), out);
}

void TextLineReader::Note(std::size_t line, const std::string& problem) {
  if (problem_.empty()) problem_ = "line " + std::to_string(line) + ": " + problem;
}

}  // namespace seastitch
