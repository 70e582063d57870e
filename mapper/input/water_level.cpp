#include "mapper/input/water_level.hpp"

#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace seastitch {
namespace {

constexpr double kHighest_m = 1000.0;  // limit, for lakes above the zero of heights

std::string Trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\"");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r\"") - begin + 1);
}

std::optional<double> Number(const std::string& text) {
  double value = 0.0;
  const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  const bool usable = error == std::errc() && stop == end && std::isfinite(value);
  return usable ? std::optional(value) : std::nullopt;
}

std::optional<Time> Utc(const std::string& text) {
  constexpr double kLatest_s = 7.0e9;  // in 2191
  if (const auto epoch_s = Number(text)) {
    if (*epoch_s < 0.0 || *epoch_s > kLatest_s) return std::nullopt;
    return Time(FromSeconds(*epoch_s));
  }
  int year = 0, hour = 0, minute = 0, read = 0;
  unsigned month = 0, day = 0;
  double second = 0.0;
  const int fields = std::sscanf(text.c_str(),
                                 "%4d%*1[-/]%2u%*1[-/]%2u%*1[T ]%2d:%2d%n",
                                 &year,
                                 &month,
                                 &day,
                                 &hour,
                                 &minute,
                                 &read);
  if (fields != 5) return std::nullopt;
  std::string rest = text.substr(static_cast<std::size_t>(read));
  for (const std::string utc : {"Z", "+00:00"})
    if (rest.ends_with(utc)) rest.resize(rest.size() - utc.size());
  if (rest.starts_with(':')) {
    const auto seconds = Number(rest.substr(1));
    if (!seconds) return std::nullopt;
    second = *seconds;
  } else if (!rest.empty()) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date{
      std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || year < 1970 || year > 2190 || hour < 0 || hour > 23 || minute < 0 ||
      minute > 59 || !(second >= 0.0 && second < 61.0))
    return std::nullopt;
  const auto midnight = std::chrono::sys_days(date).time_since_epoch();
  return Time(std::chrono::duration_cast<Duration>(midnight) +
              FromSeconds(3600.0 * hour + 60.0 * minute + second));
}

// The first column of the rest of a line, after the time. Of the further columns (sigma and flags,
// in files of NOAA) none is needed. A whole number before one of digits alone may be a number with
// a decimal comma: then both.
std::string FirstColumn(const std::string& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string first = Trimmed(rest.substr(0, end));
  if (end == std::string::npos || first.find('.') != std::string::npos) return first;
  const std::string next = Trimmed(rest.substr(end + 1, rest.find(separator, end + 1) - end - 1));
  const bool digits = !next.empty() && next.find_first_not_of("0123456789") == std::string::npos;
  return digits && !first.empty() ? first + separator + next : first;
}

}  // namespace

WaterLevel WaterLevel::Parse(const std::string& text, const std::string& name) {
  WaterLevel level;
  level.text_ = text;
  std::istringstream lines(text);
  int number = 0;
  bool is_first = true;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line = Trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const auto wrong = [&](const std::string& what) {
      return std::runtime_error(name + ":" + std::to_string(number) + ": " + what);
    };
    const std::size_t between = line.find_first_of(",;\t");
    const auto time = Utc(Trimmed(line.substr(0, between)));
    const bool names_columns = is_first && !time;
    is_first = false;
    if (names_columns) continue;
    if (between == std::string::npos) throw wrong("'" + line + "' is not TIME,METRES");
    if (!time)
      throw wrong("'" + line.substr(0, between) +
                  "' is not a time, such as 2026-05-02T10:20:30Z or seconds since 1970");
    const std::string column = FirstColumn(line.substr(between + 1), line[between]);
    if (column.empty()) continue;  // a gauge without a reading
    const auto metres = Number(column);
    if (!metres || std::abs(*metres) > kHighest_m)
      throw wrong("'" + column + "' is not a number of metres");
    const auto same = level.entries_.find(*time);
    if (same != level.entries_.end() && same->second == *metres) continue;  // the line once more
    if (!level.entries_.empty() && *time <= level.entries_.rbegin()->first)
      throw wrong("times must rise");
    level.entries_.emplace_hint(level.entries_.end(), *time, *metres);
  }
  if (level.entries_.empty()) throw std::runtime_error(name + ": no line TIME,METRES in it");
  return level;
}

double WaterLevel::At(Time t) const {
  if (entries_.empty()) return 0.0;
  const auto next = entries_.lower_bound(t);
  if (next == entries_.end()) return entries_.rbegin()->second;
  if (next == entries_.begin() || next->first == t) return next->second;
  const auto before = std::prev(next);
  const double share = ToSeconds(t - before->first) / ToSeconds(next->first - before->first);
  return before->second + share * (next->second - before->second);
}

bool WaterLevel::Covers(Time t, Duration reach) const {
  const auto next = entries_.lower_bound(t);
  return (next != entries_.end() && next->first - t <= reach) ||
         (next != entries_.begin() && t - std::prev(next)->first <= reach);
}

}  // namespace seastitch
