#include "codecs/profile_text.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "codecs/calendar.hpp"
#include "codecs/lines/text_table.hpp"
#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMostCasts = 1000;
constexpr std::size_t kMostRows = 100'000;  // of a cast

// Depth and sound speed, separated by semicolons, blanks and tabs, or commas.
std::optional<ProfileRow> RowOf(std::string_view line) {
  static const std::vector<TextColumn> kColumns{{"depth", 0}, {"speed", 1}};
  for (const char delimiter : {';', ' ', ','})
    if (const auto numbers = ReadTextRow(line, delimiter, kColumns)) {
      const auto depth_m = Find(*numbers, "depth"), speed_mps = Find(*numbers, "speed");
      if (depth_m && speed_mps) return ProfileRow{*depth_m, *speed_mps};
    }
  return std::nullopt;
}

// "20150521" and "145630" or "14:56:30".
std::optional<Time> TimeFrom(std::string_view date, std::string_view clock) {
  const std::string text = std::string(date) + " " + std::string(clock);
  const auto numbers = ReadTextRow(text, ' ', {{"date", 0}, {"clock", 1}});
  return numbers ? TimeOf(*numbers) : std::nullopt;
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
  const bool is_digits = word.find_first_not_of("0123456789") == std::string_view::npos;
  if (!is_digits || (word.size() != 12 && word.size() != 14)) return std::nullopt;
  return TimeFrom(word.substr(0, 8), std::string(word.substr(8)) + (word.size() == 12 ? "00" : ""));
}

// "2005-123" and "12:30:00" or "12:30".
std::optional<Time> TimeOfSection(std::string_view day, std::string_view clock) {
  const std::vector<std::string_view> date = Split(day, '-');
  if (date.size() != 2) return std::nullopt;
  const auto midnight =
      MidnightOfYearDay(Digits(date[0]).value_or(-1), Digits(date[1]).value_or(-1));
  const bool has_seconds = std::count(clock.begin(), clock.end(), ':') == 2;
  const auto of_day = TimeFrom("19700101", std::string(clock) + (has_seconds ? "" : ":00"));
  if (!midnight || !of_day) return std::nullopt;
  return *midnight + of_day->time_since_epoch();
}

class Reader {
 public:
  void ReadLine(std::string_view line) {
    ++line_;
    const std::vector<std::string_view> words = TextColumns(line, ' ');
    if (words.empty() || words[0].starts_with('#')) return;
    if (words[0].starts_with('(')) return BeginAsvp(words);
    if (words[0].starts_with('[')) {
      is_caris_ = true;
      return;
    }
    if (words[0] == "Section") return BeginSection(words);
    if (is_caris_ && !is_open_) return;  // the name of the file
    AddRow(line);
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
  void AddRow(std::string_view line) {
    const std::optional<ProfileRow> row = RowOf(line);
    if (row && rows_.size() < kMostRows)
      rows_.push_back(*row);
    else if (row)
      Complain("a cast of more than " + std::to_string(kMostRows) + " depths");
    else if (is_open_ || !rows_.empty())
      Complain("expected depth and sound speed");
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
    reader.ReadLine(Trimmed(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return reader.Finish();
}

}  // namespace seastitch
