#include "codecs/lines/text_table.hpp"

#include <algorithm>
#include <array>
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

// Three numbers with a separator between them; nothing for any other text.
std::optional<std::array<double, 3>> Triple(std::string_view text, char separator) {
  const auto parts = Split(text, separator);
  if (parts.size() != 3) return std::nullopt;
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = ParseNumber(parts[i]);
    if (!number) return std::nullopt;
    out[i] = *number;
  }
  return out;
}

// Date or clock as numbers; false for any other text.
bool ReadTimeText(const std::string& quantity, std::string_view text, TextNumbers* numbers) {
  if (quantity == "iso") {
    const std::size_t split = text.find_first_of("T ");
    if (split == std::string_view::npos) return false;
    std::string_view clock = text.substr(split + 1);
    for (const std::string_view utc : {"Z", "+00:00"})
      if (clock.ends_with(utc)) clock.remove_suffix(utc.size());
    return ReadTimeText("date", text.substr(0, split), numbers) &&
           ReadTimeText("clock", clock, numbers);
  }
  const bool date = quantity == "date";
  const auto parts = Triple(text, date ? '-' : ':');
  if (!parts) return false;
  constexpr std::array kDate{"year", "month", "day"};
  constexpr std::array kClock{"hour", "minute", "second"};
  for (std::size_t i = 0; i < 3; ++i) (*numbers)[date ? kDate[i] : kClock[i]] = (*parts)[i];
  return true;
}

}  // namespace

std::vector<std::string_view> TextColumns(std::string_view line, char delimiter) {
  if (delimiter != ' ') return Split(line, delimiter);
  std::vector<std::string_view> fields;
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    fields.push_back(line.substr(at, end - at));
    at = end;
  }
  return fields;
}

std::optional<double> Find(const TextNumbers& numbers, std::string_view quantity) {
  const auto found = numbers.find(quantity);
  return found == numbers.end() ? std::nullopt : std::optional(found->second);
}

std::optional<TextNumbers> ReadTextRow(std::string_view line,
                                       char delimiter,
                                       const std::vector<TextColumn>& columns) {
  const std::vector<std::string_view> fields = TextColumns(line, delimiter);
  TextNumbers numbers;
  for (const TextColumn& column : columns) {
    const std::string_view text =
        column.column < fields.size() ? Trimmed(fields[column.column]) : std::string_view();
    if (text.empty()) continue;
    if (IsTimeText(column.quantity)) {
      if (!ReadTimeText(column.quantity, text, &numbers)) return std::nullopt;
      continue;
    }
    const auto number = ParseNumber(text);
    if (!number || !(std::abs(*number * column.scale) < 1e12)) return std::nullopt;
    numbers[column.quantity] = *number * column.scale;
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
  return *midnight + std::chrono::hours(hour) + std::chrono::minutes(minute) + FromSeconds(second);
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

}  // namespace seastitch
