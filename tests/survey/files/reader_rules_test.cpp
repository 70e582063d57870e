// One rule for each fault of survey files, through every reader that can meet it. The table of
// docs/survey-files.md is made of the cells here:
//   SEASTITCH_WRITE_DOCS=1 build/tests/seastitch_survey_test --gtest_filter='ReaderRulesPage.*'
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/geo/map_frame.hpp"
#include "survey/errors.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_config.hpp"
#include "survey/replay/replay_feed.hpp"
#include "survey/replay/replay_input.hpp"
#include "survey/session/local_mapper.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/survey/files/placed_pings.hpp"
#include "tests/survey/files/small_survey.hpp"

namespace seastitch {
namespace {

using enum SurveyFormat;

enum class Rule {
  kFeet,
  kWeekEnds,
  kInUtc,
  kClockAhead,
  kWeeksOverflow,
  kNoAttitude,
  kNoProfile,
  kTwoHeads,
  kWaterLine,
  kCutOff,
  kOutOfOrder,
  kStampsJump,
  kTwice,
};

struct RuleText {
  Rule rule;
  const char* text;
};
constexpr RuleText kRules[] = {
    {Rule::kFeet, "grid and depths in feet"},
    {Rule::kWeekEnds, "the GPS week ends inside the file"},
    {Rule::kInUtc, "UTC in place of GPS time"},
    {Rule::kClockAhead, "a sensor by GPS time in place of UTC (18 s)"},
    {Rule::kWeeksOverflow, "a sensor 1024 weeks early"},
    {Rule::kNoAttitude, "a heading, no roll and pitch"},
    {Rule::kNoProfile, "no sound speed profile"},
    {Rule::kTwoHeads, "two heads"},
    {Rule::kWaterLine, "the water line changes"},
    {Rule::kCutOff, "cut off"},
    {Rule::kOutOfOrder, "two halves in the wrong order"},
    {Rule::kStampsJump, "stamps of some pings jump by 20 s"},
    {Rule::kTwice, "given twice, under two names"},
};

// Soundings are where they are without the fault (of a file that is cut off: those before the cut);
// or they are, and a warning or counter names the fault; or the command ends with the reason.
enum class Outcome { kRight, kNamed, kRefused };

struct Cell {
  Rule rule;
  SurveyFormat format;
  Outcome outcome;
  std::optional<WarningCode> warning{};
  const char* counter = "";
};

const std::vector<Cell> kCells{
    {Rule::kFeet, kLas, Outcome::kRight},
    {Rule::kFeet, kXyz, Outcome::kNamed, WarningCode::kUnitAssumed},
    {Rule::kWeekEnds, kSbet, Outcome::kRight},
    {Rule::kWeekEnds, kLas, Outcome::kRight},
    {Rule::kInUtc, kSbet, Outcome::kRight},
    {Rule::kInUtc, kLas, Outcome::kRight},
    {Rule::kClockAhead, kKmall, Outcome::kNamed, WarningCode::kSensorClock},
    {Rule::kClockAhead, kAll, Outcome::kNamed, WarningCode::kSensorClock},
    {Rule::kWeeksOverflow, kKmall, Outcome::kNamed, std::nullopt, "stamps_wrong"},
    {Rule::kNoAttitude, kKmall, Outcome::kRefused},
    {Rule::kNoAttitude, kAll, Outcome::kRefused},
    {Rule::kNoAttitude, kS7k, Outcome::kRefused},
    {Rule::kNoAttitude, kXtf, Outcome::kRefused},
    {Rule::kNoProfile, kKmall, Outcome::kNamed, WarningCode::kNoSoundSpeedProfile},
    {Rule::kNoProfile, kAll, Outcome::kNamed, WarningCode::kNoSoundSpeedProfile},
    {Rule::kNoProfile, kS7k, Outcome::kNamed, WarningCode::kNoSoundSpeedProfile},
    {Rule::kNoProfile, kXtf, Outcome::kNamed, WarningCode::kNoSoundSpeedProfile},  // never has one
    {Rule::kTwoHeads, kKmall, Outcome::kRight},
    {Rule::kTwoHeads, kAll, Outcome::kRight},
    {Rule::kTwoHeads, kS7k, Outcome::kRight},
    {Rule::kTwoHeads, kXtf, Outcome::kRight},
    {Rule::kWaterLine, kKmall, Outcome::kRight},
    {Rule::kWaterLine, kAll, Outcome::kRight},
    {Rule::kWaterLine, kS7k, Outcome::kRight},
    {Rule::kCutOff, kKmall, Outcome::kRight},
    {Rule::kCutOff, kAll, Outcome::kRight},
    {Rule::kCutOff, kS7k, Outcome::kRight},
    {Rule::kCutOff, kXtf, Outcome::kRight},
    {Rule::kCutOff, kGsf, Outcome::kRight},
    {Rule::kCutOff, kCereal, Outcome::kNamed, WarningCode::kFileCutOff},
    {Rule::kCutOff, kSbet, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kCutOff, kText, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kCutOff, kLas, Outcome::kNamed, WarningCode::kFileCutOff},
    {Rule::kOutOfOrder, kKmall, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kAll, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kS7k, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kXtf, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kGsf, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kCereal, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kSbet, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kText, Outcome::kNamed, WarningCode::kFileOutOfOrder},
    {Rule::kOutOfOrder, kLas, Outcome::kRight},
    {Rule::kStampsJump, kKmall, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kStampsJump, kAll, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kStampsJump, kS7k, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kStampsJump, kXtf, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kStampsJump, kGsf, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kStampsJump, kCereal, Outcome::kNamed, WarningCode::kPingsLost},
    {Rule::kTwice, kKmall, Outcome::kRight},
    {Rule::kTwice, kAll, Outcome::kRight},
    {Rule::kTwice, kS7k, Outcome::kRight},
    {Rule::kTwice, kXtf, Outcome::kRight},
    {Rule::kTwice, kGsf, Outcome::kRight},
    {Rule::kTwice, kCereal, Outcome::kRight},
    {Rule::kTwice, kSbet, Outcome::kRight},
    {Rule::kTwice, kText, Outcome::kRight},
    {Rule::kTwice, kLas, Outcome::kRight},
    {Rule::kTwice, kXyz, Outcome::kRight},
};

// What is named of a survey without a fault: an XTF has no profile.
std::set<WarningCode> WarningsWithout(SurveyFormat format) {
  if (format == kXtf) return {WarningCode::kNoSoundSpeedProfile};
  return {};
}

constexpr double kWaterLineM = -1.0;

SurveyFaults FaultsOf(Rule rule) {
  switch (rule) {
    case Rule::kFeet: return {.in_feet = true};
    case Rule::kWeekEnds: return {.week_ends = true};
    case Rule::kInUtc: return {.in_utc = true};
    case Rule::kClockAhead: return {.sensors_ahead_s = 18.0};
    case Rule::kWeeksOverflow: return {.weeks_overflow = true};
    case Rule::kNoAttitude: return {.no_attitude = true};
    case Rule::kNoProfile: return {.no_profile = true};
    case Rule::kTwoHeads: return {.two_heads = true};
    case Rule::kWaterLine: return {.water_line_m = kWaterLineM};
    case Rule::kStampsJump: return {.jump_s = 20.0};
    case Rule::kOutOfOrder: return {.pause_s = 300.0};
    default: return {};
  }
}

// A ping of the map.
struct MapPing {
  double t_s;  // since the survey's start
  std::size_t soundings;
  Eigen::Vector3d mean_m;  // about the survey's start
};

// By time.
std::vector<MapPing> PingsOf(const PlacedSurvey& survey, Time start, SurveyFormat format) {
  const MapFrame map(
      {.latitude_deg = survey.datum_latitude_deg, .longitude_deg = survey.datum_longitude_deg}),
      about_start({.latitude_deg = 57.1, .longitude_deg = 11.2});
  std::vector<MapPing> pings;
  for (const PlacedSoundings& ping : survey.pings) {
    MapPing of{ToSeconds(ping.time - start), ping.p_map_m.size(), Eigen::Vector3d::Zero()};
    for (const Eigen::Vector3d& p : ping.p_map_m) of.mean_m += p;
    if (of.soundings > 0) of.mean_m /= static_cast<double>(of.soundings);
    if (format != kCereal)
      of.mean_m.head<2>() = about_start.NorthEastOf(map.PointAt(of.mean_m.head<2>()));
    pings.push_back(of);
  }
  std::stable_sort(
      pings.begin(), pings.end(), [](const MapPing& a, const MapPing& b) { return a.t_s < b.t_s; });
  return pings;
}

std::vector<MapWarning> WarningsOf(const std::vector<std::filesystem::path>& files) {
  const TemporaryDir dir;
  Input input;
  input.survey_files = std::make_unique<SurveyFiles>(PlanSurvey(files));
  MapperConfig config;
  config.map_dir = dir.path();
  UseSurvey(input.survey_files->plan(), false, &config);
  LocalMapper mapper(config, [](const MapperEvent&) {});
  ReplayInput replay_input{.quiet = true, .stopped = [] { return false; }};
  Feed(
      &input,
      nullptr,
      [&](const Received& sample, std::size_t) { mapper.Add(sample); },
      &replay_input);
  mapper.Finish();
  SayHowMapped(input, mapper.mapper(), "", &replay_input);
  WarnOfDepths(mapper.mapper(), "", &replay_input);
  return replay_input.warnings;
}

class ReaderRules : public testing::TestWithParam<Cell> {};

TEST_P(ReaderRules, ThroughEveryReader) {
  const Cell& cell = GetParam();
  const TemporaryDir right_dir, dir;
  const SurveyFaults faults = FaultsOf(cell.rule);
  const SmallSurvey without(cell.format, {.pause_s = faults.pause_s}), with(cell.format, faults);
  const PlacedSurvey right = PlaceSurvey(without.Write(without.bytes(), right_dir));
  ASSERT_GE(right.pings.size(), 0.9 * SmallSurvey::kPings);

  std::string bytes = with.bytes();
  const auto joined = [&with](std::size_t from, std::size_t to) {
    std::string part;
    for (std::size_t i = from; i < to; ++i) part += with.records()[i];
    return part;
  };
  if (cell.rule == Rule::kCutOff)
    bytes.resize(with.head().size() + (bytes.size() - with.head().size()) * 6 / 10 + 7);
  const std::size_t all = with.records().size();
  if (cell.rule == Rule::kOutOfOrder)
    bytes = with.head() + joined(all / 2, all) + joined(0, all / 2);
  std::vector<std::filesystem::path> files = with.Write(bytes, dir);
  if (cell.rule == Rule::kTwice) {
    const std::filesystem::path copy = dir / ("copy" + files[0].extension().string());
    std::filesystem::copy_file(files[0], copy);
    if (std::filesystem::exists(files[0].string() + ".yaml"))
      std::filesystem::copy_file(files[0].string() + ".yaml", copy.string() + ".yaml");
    files.push_back(copy);
  }
  if (cell.outcome == Outcome::kRefused) {
    EXPECT_THROW(PlaceSurvey(files), DataError);
    return;
  }

  const PlacedSurvey survey = PlaceSurvey(files);
  std::set<WarningCode> named, expected_named = WarningsWithout(cell.format);
  for (const MapWarning& warning : WarningsOf(files)) named.insert(warning.code);
  if (cell.warning) expected_named.insert(*cell.warning);
  if (cell.warning == WarningCode::kFileOutOfOrder) expected_named.insert(WarningCode::kPingsLost);
  EXPECT_EQ(named, expected_named);
  if (*cell.counter != 0) {
    EXPECT_TRUE(survey.counters.contains(cell.counter));
  }
  const std::vector<MapPing> expected = PingsOf(right, SmallSurvey::Start({}), cell.format);
  const std::vector<MapPing> found = PingsOf(survey, SmallSurvey::Start(faults), cell.format);
  std::size_t least = expected.size();
  if (cell.rule == Rule::kCutOff) least = expected.size() / 2;
  if (cell.warning == WarningCode::kPingsLost || cell.warning == WarningCode::kFileOutOfOrder)
    least = expected.size() / 4;
  EXPECT_GE(found.size(), least);
  EXPECT_LE(found.size(), expected.size());
  Eigen::Vector3d grid_off_m = Eigen::Vector3d::Zero();
  for (const MapPing& ping : found) {
    SCOPED_TRACE(testing::Message() << "ping at " << ping.t_s << " s");
    const auto same = std::find_if(expected.begin(), expected.end(), [&](const MapPing& other) {
      return std::abs(other.t_s - ping.t_s) < 1e-3;
    });
    ASSERT_NE(same, expected.end());
    // The last ping of a file that is cut off may lack soundings.
    if (cell.rule == Rule::kCutOff && &ping == &found.back()) continue;
    EXPECT_EQ(ping.soundings, same->soundings);
    Eigen::Vector3d off_m = ping.mean_m - same->mean_m;
    // A grid that has no place on the Earth begins at the first position.
    if (cell.format == kCereal && &ping == &found.front()) grid_off_m.head<2>() = off_m.head<2>();
    off_m -= grid_off_m;
    // The water line is above the vehicle's reference point: it is that much deeper. Between two
    // depths the depth is interpolated.
    const double since_change_s = ping.t_s - 0.25 * SmallSurvey::kPings;
    if (cell.rule == Rule::kWaterLine && std::abs(since_change_s) < 1.0) continue;
    if (cell.rule == Rule::kWaterLine && since_change_s > 0.0) off_m.z() += kWaterLineM;
    EXPECT_LT(off_m.norm(), 0.01) << off_m.transpose();
  }
}

constexpr const char* kFormatNames[] = {
    ".kmall", ".all", ".s7k", "XTF", "GSF", ".cereal", "SBET", "text", "LAS", "XYZ"};

INSTANTIATE_TEST_SUITE_P(Cells, ReaderRules, testing::ValuesIn(kCells), [](const auto& test) {
  std::string name = kFormatNames[static_cast<int>(test.param.format)];
  std::erase(name, '.');
  return "Rule" + std::to_string(static_cast<int>(test.param.rule)) + "_" + name;
});

std::string WordOf(const Cell& cell) {
  switch (cell.outcome) {
    case Outcome::kRight: return "right";
    case Outcome::kRefused: return "refused";
    case Outcome::kNamed: break;
  }
  const bool is_loss = cell.warning == WarningCode::kPingsLost ||
                       cell.warning == WarningCode::kFileCutOff ||
                       cell.warning == WarningCode::kFileOutOfOrder;
  return std::string(is_loss ? "part" : "right") + "; `" +
         std::string(cell.warning ? NameOf(*cell.warning) : cell.counter) + "`";
}

std::string Table() {
  std::string table = "| fault |", line = "|---|";
  for (const char* const format : kFormatNames) {
    table += std::string(" ") + format + " |";
    line += "---|";
  }
  table += "\n" + line + "\n";
  for (const RuleText& rule : kRules) {
    table += std::string("| ") + rule.text + " |";
    for (int format = 0; format < kSurveyFormats; ++format) {
      const auto cell = std::find_if(kCells.begin(), kCells.end(), [&](const Cell& c) {
        return c.rule == rule.rule && static_cast<int>(c.format) == format;
      });
      table += " " + (cell == kCells.end() ? std::string("-") : WordOf(*cell)) + " |";
    }
    table += "\n";
  }
  return table;
}

TEST(ReaderRulesPage, IsTheTableOfTheCells) {
  const std::filesystem::path path = SourceDir() / "docs/survey-files-accuracy.md";
  const std::string begin = "<!-- made by reader_rules_test.cpp -->\n", end = "<!-- end -->\n";
  std::string page = TextOf(path);
  const std::size_t from = page.find(begin) + begin.size(), to = page.find(end);
  ASSERT_TRUE(page.find(begin) != std::string::npos && to != std::string::npos && from <= to);
  if (std::getenv("SEASTITCH_WRITE_DOCS") != nullptr)
    std::ofstream(path) << page.replace(from, to - from, Table());
  else
    EXPECT_EQ(page.substr(from, to - from), Table());
}

}  // namespace
}  // namespace seastitch
