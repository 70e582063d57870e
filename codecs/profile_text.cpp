#include "codecs/profile_text.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMostCasts = 1000;
constexpr std::size_t kMostRows = 100'000;  // of a cast

std::vector<std::string_view> Words(std::string_view line) {
  constexpr std::string_view kBetween = " \t\r,;";
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBetween, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBetween, end);
  }
  return words;
}

std::optional<int> Digits(std::string_view text) {
  if (text.empty() || text.size() > 9) return std::nullopt;
  int value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + (c - '0');
  }
  return value;
}

// "201505211456" or, with seconds, "20150521145630".
std::optional<Time> TimeOfAsvp(std::string_view word) {
  if (word.size() != 12 && word.size() != 14) return std::nullopt;
  const auto part = [word](std::size_t at, std::size_t digits) {
    return Digits(word.substr(std::min(at, word.size()), digits)).value_or(-1);
  };
  const std::optional<Time> day = Midnight(part(0, 4), part(4, 2), part(6, 2));
  const int hour = part(8, 2), minute = part(10, 2), second = word.size() == 14 ? part(12, 2) : 0;
  if (!day || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60)
    return std::nullopt;
  return *day + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         std::chrono::seconds(second);
}

// "2005-123" and "12:30:00".
std::optional<Time> TimeOfSection(std::string_view day, std::string_view time) {
  const std::vector<std::string_view> date = Split(day, '-');
  const std::vector<std::string_view> clock = Split(time, ':');
  if (date.size() != 2 || clock.size() < 2 || clock.size() > 3) return std::nullopt;
  const std::optional<Time> midnight =
      MidnightOfYearDay(Digits(date[0]).value_or(-1), Digits(date[1]).value_or(-1));
  const int hour = Digits(clock[0]).value_or(-1), minute = Digits(clock[1]).value_or(-1);
  const double second = clock.size() == 3 ? ParseNumber(clock[2]).value_or(-1.0) : 0.0;
  if (!midnight || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0.0 ||
      second >= 61.0)
    return std::nullopt;
  return *midnight + std::chrono::hours(hour) + std::chrono::minutes(minute) + FromSeconds(second);
}

class Reader {
 public:
  void ReadLine(std::string_view line) {
    ++line_;
    const std::vector<std::string_view> words = Words(line);
    if (words.empty() || words[0].starts_with('#')) return;
    if (words[0].starts_with('(')) return BeginAsvp(words);
    if (words[0].starts_with('[')) {
      is_caris_ = true;
      return;
    }
    if (words[0] == "Section") return BeginSection(words);
    if (is_caris_ && !is_open_) return;  // the name of the file
    AddRow(words);
  }
  ProfileText Finish() {
    EndCast();
    if (result_.casts.empty() && result_.problem.empty())
      result_.problem = "no row of depth and sound speed";
    return std::move(result_);
  }

 private:
  void BeginAsvp(const std::vector<std::string_view>& words) {
    Begin(std::nullopt);
    for (const std::string_view word : words)
      if (const std::optional<Time> time = TimeOfAsvp(word); time && !time_) time_ = time;
    if (!time_) Complain("no time as in ( SoundVelocity 1.0 0 201505211456 ...");
  }
  void BeginSection(const std::vector<std::string_view>& words) {
    Begin(words.size() < 3 ? std::nullopt : TimeOfSection(words[1], words[2]));
    if (!time_) Complain("no time as in Section 2005-123 12:30:00");
  }
  void Begin(std::optional<Time> time) {
    EndCast();
    is_open_ = true;
    time_ = time;
  }
  void AddRow(const std::vector<std::string_view>& words) {
    const auto first = ParseNumber(words[0]);
    const auto second = words.size() < 2 ? std::nullopt : ParseNumber(words[1]);
    if (first && second && rows_.size() < kMostRows) return rows_.push_back({*first, *second});
    if (is_open_ || !rows_.empty()) Complain("expected depth and sound speed");
  }
  void Complain(const std::string& what) {
    if (result_.problem.empty()) result_.problem = "line " + std::to_string(line_) + ": " + what;
  }
  void EndCast() {
    std::vector<ProfileRow> rows = std::exchange(rows_, {});
    const std::optional<Time> time = std::exchange(time_, std::nullopt);
    if (rows.empty() || result_.casts.size() >= kMostCasts) return;
    auto profile = ProfileFrom(time.value_or(Time()), std::move(rows));
    if (profile && profile->depth_m.size() > 1)
      result_.casts.push_back({time, std::move(*profile)});
    else if (result_.problem.empty())
      result_.problem = "a cast of fewer than two depths with a sound speed of sea water in m/s";
  }

  ProfileText result_;
  int line_ = 0;
  bool is_caris_ = false;
  bool is_open_ = false;  // a cast with a header
  std::optional<Time> time_;
  std::vector<ProfileRow> rows_;
};

}  // namespace

ProfileText ParseProfileText(std::string_view text) {
  Reader reader;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    reader.ReadLine(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return reader.Finish();
}

}  // namespace seastitch
