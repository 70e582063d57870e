#include "codecs/text_navigation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxLine = 4096;

constexpr std::array kQuantities{"epoch",     "year",    "month", "day",    "hour",
                                 "minute",    "second",  "date",  "clock",  "iso",
                                 "north",     "east",    "depth", "height", "latitude",
                                 "longitude", "heading", "roll",  "pitch",  "heave"};

using Fields = std::vector<std::string_view>;
using Numbers = std::map<std::string, double, std::less<>>;

std::optional<double> Find(const Numbers& numbers, std::string_view name) {
  const auto found = numbers.find(name);
  return found == numbers.end() ? std::nullopt : std::optional(found->second);
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
bool ReadTimeText(const std::string& quantity, std::string_view text, Numbers* numbers) {
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

std::optional<Time> TimeOf(const Numbers& n) {
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

bool FillPlace(const Numbers& n, NavigationRecord* sample) {
  const auto latitude_deg = Find(n, "latitude");
  const auto longitude_deg = Find(n, "longitude");
  const auto north_m = Find(n, "north");
  const auto east_m = Find(n, "east");
  if (latitude_deg && longitude_deg) {
    if (std::abs(*latitude_deg) > 90.0 || std::abs(*longitude_deg) > 360.0) return false;
    sample->position = GivenPosition{Deg2Rad(*latitude_deg), WrapAngle(Deg2Rad(*longitude_deg))};
  }
  if (north_m && east_m) sample->grid_north_east_m = Eigen::Vector2d(*north_m, *east_m);
  return sample->position || sample->grid_north_east_m;
}

void FillAttitude(const Numbers& n, NavigationRecord* sample) {
  const auto heading_deg = Find(n, "heading");
  const auto roll_deg = Find(n, "roll");
  const auto pitch_deg = Find(n, "pitch");
  if (heading_deg && roll_deg && pitch_deg)
    sample->attitude = AttitudeFromDegrees(*roll_deg, *pitch_deg, *heading_deg);
  else if (heading_deg)
    sample->heading_rad = Deg2Rad(*heading_deg);
  else if (roll_deg && pitch_deg)
    sample->roll_pitch_rad = Eigen::Vector2d(Deg2Rad(*roll_deg), Deg2Rad(*pitch_deg));
}

// Both formats of MB-System have the same columns up to roll and pitch.
TextNavigationFormat MbSystem(const std::string& source) {
  TextNavigationFormat format;
  format.source = source;
  std::size_t column = 0;
  for (const char* quantity : {"year", "month", "day", "hour", "minute", "second"})
    format.columns.push_back({quantity, column++});
  for (const auto& [quantity, at] : {std::pair{"longitude", 7u},
                                     std::pair{"latitude", 8u},
                                     std::pair{"heading", 9u},
                                     std::pair{"depth", 11u},
                                     std::pair{"roll", 12u},
                                     std::pair{"pitch", 13u}})
    format.columns.push_back({quantity, at});
  return format;
}

}  // namespace

TextNavigationFormat TextNavigationFormat::Fnv() { return MbSystem("fnv"); }
TextNavigationFormat TextNavigationFormat::Na0() { return MbSystem("na0"); }

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

std::string TextNavigationFormat::Validate() const {
  std::map<std::string, int> given;
  for (const TextColumn& column : columns) {
    if (std::find(kQuantities.begin(), kQuantities.end(), column.quantity) == kQuantities.end())
      return "'" + column.quantity + "' is no quantity of a column";
    if (!std::isfinite(column.scale) || column.scale == 0.0)
      return column.quantity + ": scale must not be 0";
    if (++given[column.quantity] > 1) return column.quantity + " stands in two columns";
  }
  const auto all = [&given](std::initializer_list<const char*> names) {
    return std::all_of(
        names.begin(), names.end(), [&](const char* n) { return given.contains(n); });
  };
  const bool date = all({"date"}) || all({"year", "month", "day"});
  const bool clock = all({"clock"}) || all({"hour", "minute", "second"});
  if (!all({"epoch"}) && !all({"iso"}) && !(date && clock)) return "no column gives the time";
  if (!all({"latitude", "longitude"}) && !all({"north", "east"}))
    return "no columns give the position";
  return "";
}

TextNavigationReader::TextNavigationReader(TextNavigationFormat format)
    : format_(std::move(format)) {
  if (const std::string problem = format_.Validate(); !problem.empty())
    throw std::invalid_argument(problem);
}

SurveyReader::Look TextNavigationReader::LookAt(Bytes bytes, bool at_end) const {
  const Bytes line = bytes.first(std::min(bytes.size(), kMaxLine));
  const auto end = std::find(line.begin(), line.end(), '\n');
  if (end != line.end()) return Record(static_cast<std::size_t>(end - line.begin()) + 1);
  if (line.size() == kMaxLine) return Damage(kMaxLine);
  return at_end ? Record(bytes.size()) : TooShort();
}

void TextNavigationReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  const std::string text(record.begin(), record.end());
  const std::string_view line = Trimmed(text);
  if (lines_++ < format_.header_lines || line.empty() || line.front() == format_.comment) return;
  auto sample = ReadLine(line);
  if (!sample) return Count("text_malformed");
  if (last_ && sample->time <= *last_) return Count("text_time_not_rising");
  last_ = sample->time;
  out->emplace_back(std::move(*sample));
}

std::optional<NavigationRecord> TextNavigationReader::ReadLine(std::string_view line) const {
  const Fields fields = TextColumns(line, format_.delimiter);
  Numbers numbers;
  for (const TextColumn& column : format_.columns) {
    const std::string_view text =
        column.column < fields.size() ? Trimmed(fields[column.column]) : std::string_view();
    if (text.empty()) continue;
    if (column.quantity == "date" || column.quantity == "clock" || column.quantity == "iso") {
      if (!ReadTimeText(column.quantity, text, &numbers)) return std::nullopt;
      continue;
    }
    const auto number = ParseNumber(text);
    if (!number || !(std::abs(*number * column.scale) < 1e12)) return std::nullopt;
    numbers[column.quantity] = *number * column.scale;
  }
  const auto time = TimeOf(numbers);
  NavigationRecord sample;
  if (!time || !FillPlace(numbers, &sample)) return std::nullopt;
  sample.time = *time;
  sample.source = format_.source;
  sample.depth_m = Find(numbers, "depth");
  sample.height_m = Find(numbers, "height");
  sample.heave_m = Find(numbers, "heave");
  FillAttitude(numbers, &sample);
  return sample;
}

}  // namespace seastitch
