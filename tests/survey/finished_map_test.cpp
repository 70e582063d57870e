// The map of an earlier replay as an input, through the command line.

#include "survey/replay/finished_map.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <vector>

#include "common/storage/submap_file.hpp"
#include "survey/read/message_types.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/kmall_pieces.hpp"
#include "tests/survey/three_dives.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

void Write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

struct Position {
  double latitude_deg, longitude_deg;
};

// Three lines of 60 m, cut into the three folders dive1, dive2, dive3 of survey files. Maps of them
// are made once: A (dive1), AB (dive1, dive2), C (dive3).
class FinishedMaps : public ::testing::Test {
 protected:
  static const fs::path& Folder() {
    static const TemporaryDir dir;
    static const bool made = [] {
      testing::MakeThreeDives(dir.path());
      for (const char* const map : {"dive1 --out A", "dive1 dive2 --out AB", "dive3 --out C"}) {
        const CommandResult result = Run(dir.path(), map);
        EXPECT_EQ(result.exit_code, 0) << result.output;
      }
      return true;
    }();
    EXPECT_TRUE(made);
    return dir.path();
  }

  static CommandResult Run(const fs::path& folder, const std::string& arguments) {
    return RunCommand("cd " + folder.string() + " && " + Program("seastitch") +
                      " replay --quiet --truth l.lcmlog.truth.csv " + arguments);
  }
  // Into out_.path() / name.
  CommandResult Replay(const std::string& inputs, const std::string& name = "map") {
    return Run(Folder(), inputs + " --out " + Out(name).string());
  }
  fs::path Out(const std::string& name = "map") const { return out_.path() / name; }

  // A copy of a map, to be spoiled.
  fs::path CopyOf(const std::string& map, const std::string& name) const {
    fs::copy(Folder() / map, Out(name), fs::copy_options::recursive);
    return Out(name);
  }

  TemporaryDir out_;
};

nlohmann::json ReportOf(const fs::path& map) {
  return nlohmann::json::parse(TextOf(map / "report.json"));
}

double ShapeOf(const fs::path& map) {
  return ReportOf(map)["truth"]["aligned_position_rms_m"]["after"];
}

std::vector<double> PosesOf(const fs::path& map) {
  std::istringstream in(TextOf(map / "poses.txt"));
  return {std::istream_iterator<double>(in), {}};
}

double LargestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size() || a.empty()) return HUGE_VAL;
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

std::vector<std::vector<double>> TrackOf(const fs::path& map) {
  std::istringstream in(TextOf(map / "track.csv"));
  std::string line;
  std::getline(in, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream row(line);
    rows.push_back({std::istream_iterator<double>(row), {}});
  }
  return rows;
}
constexpr std::size_t kSigmaX = 11, kSigmaYaw = 13, kLatitude = 14, kLongitude = 15;

double MeanOf(const std::vector<std::vector<double>>& rows, std::size_t column) {
  double sum = 0.0;
  for (const auto& row : rows) sum += row.at(column);
  return sum / static_cast<double>(rows.size());
}

// North, east [m] from the first row of the other track, by latitude and longitude.
double LargestDistanceM(const std::vector<std::vector<double>>& a,
                        const std::vector<std::vector<double>>& b) {
  if (a.size() != b.size()) return HUGE_VAL;
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double north_m = 111e3 * (a[i][kLatitude] - b[i][kLatitude]);
    const double east_m = 81e3 * (a[i][kLongitude] - b[i][kLongitude]);
    largest = std::max(largest, std::hypot(north_m, east_m));
  }
  return largest;
}

std::vector<std::string> NamesOf(const nlohmann::json& dives) {
  std::vector<std::string> names;
  for (const auto& dive : dives) names.push_back(dive["name"]);
  return names;
}

void ExpectOneLine(const CommandResult& result, int exit_code, const std::string& text) {
  EXPECT_EQ(result.exit_code, exit_code) << result.output;
  EXPECT_THAT(result.output, HasSubstr(text));
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
}

PointCloud PointsOf(const fs::path& pcd) { return ReadSubmapPcd(pcd).cloud; }

float LargestDistanceM(const PointCloud& a, const PointCloud& b) {
  if (a.size() != b.size()) return HUGE_VALF;
  float largest = 0.0f;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, (a.points[i] - b.points[i]).norm());
  return largest;
}

TEST_F(FinishedMaps, AloneGivesTheSameMapAndRegistersNothing) {
  for (const char* const map : {"A", "AB"}) {
    const CommandResult result = Replay(map, map);
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const fs::path again = Out(map), first = Folder() / map;
    EXPECT_LT(LargestDifference(PosesOf(again), PosesOf(first)), 1e-6);
    EXPECT_EQ(ReportOf(again)["loop_closures"]["verdicts"],
              ReportOf(first)["loop_closures"]["verdicts"]);
    EXPECT_EQ(ReportOf(again)["refused"], ReportOf(first)["refused"]);
    EXPECT_FALSE(ReportOf(again)["mapper_counters"].contains("registrations"));
    EXPECT_LT(LargestDistanceM(TrackOf(again), TrackOf(first)), 1e-3);
    EXPECT_EQ(fs::file_size(again / "export/navigation.sbet"),
              fs::file_size(first / "export/navigation.sbet"));
    EXPECT_EQ(TextOf(again / "export/lines.csv"), TextOf(first / "export/lines.csv"));
    // Sheared once, not twice: the graph found an angle of the DVL.
    for (const auto& file : fs::directory_iterator(first / "submaps"))
      EXPECT_LT(LargestDistanceM(PointsOf(file.path()),
                                 PointsOf(again / "submaps" / file.path().filename())),
                1e-5);
  }
  EXPECT_TRUE(TextOf(Out("A") / "elevation.tif") == TextOf(Folder() / "A/elevation.tif"));
}

// Whole surveys: docs/measurements/surveys.md.
TEST_F(FinishedMaps, WithTheRestOfTheSurveyGiveTheMapOfAllAtOnce) {
  ASSERT_EQ(Replay("dive1 dive2 dive3", "at_once").exit_code, 0);
  const CommandResult joined = Replay("AB dive3", "joined");
  ASSERT_EQ(joined.exit_code, 0) << joined.output;
  EXPECT_LT(ShapeOf(Out("joined")), 1.05 * ShapeOf(Out("at_once")));
  EXPECT_LT(LargestDifference(PosesOf(Out("joined")), PosesOf(Out("at_once"))), 1e-3);

  const auto at_once = TrackOf(Out("at_once")), track = TrackOf(Out("joined"));
  EXPECT_EQ(track.size(), at_once.size());
  // Not more certain: nothing counts twice.
  for (std::size_t column = kSigmaX; column <= kSigmaYaw; ++column) {
    EXPECT_GT(MeanOf(track, column), 0.99 * MeanOf(at_once, column));
    EXPECT_LT(MeanOf(track, column), 1.05 * MeanOf(at_once, column));
  }
  const nlohmann::json report = ReportOf(Out("joined"));
  EXPECT_THAT(NamesOf(report["dives"]), ElementsAre("AB: dive1", "AB: dive2", "dive3"));
  EXPECT_GE(report["dives"][2]["closures_with"]["AB: dive2"], 1);
  EXPECT_GE(report["dives"][0]["closures_with"]["AB: dive2"], 1);
  // Each dive keeps its own mounting errors and what its replay reported.
  EXPECT_TRUE(report["dives"][1]["mounting"].contains("dvl_yaw_deg"));
  EXPECT_EQ(report["dives"][1]["mapper_counters"],
            ReportOf(Out("at_once"))["dives"][1]["mapper_counters"]);
  EXPECT_THAT(TextOf(Out("joined") / "report.html"), HasSubstr("is joined to AB: dive1"));
}

TEST_F(FinishedMaps, InAnyOrderAndTwoOfThem) {
  ASSERT_EQ(Replay("dive3 dive1 dive2", "at_once").exit_code, 0);
  const double shape_m = ShapeOf(Out("at_once"));
  for (const char* const inputs : {"dive3 AB", "C AB"}) {
    const CommandResult result = Replay(inputs, "joined");
    ASSERT_EQ(result.exit_code, 0) << inputs << result.output;
    const nlohmann::json report = ReportOf(Out("joined"));
    ASSERT_EQ(report["dives"].size(), 3u);
    for (const auto& dive : report["dives"]) EXPECT_EQ(dive["group"], 0) << result.output;
    EXPECT_LT(ShapeOf(Out("joined")), 1.05 * shape_m) << inputs;
    EXPECT_EQ(TrackOf(Out("joined")).size(), TrackOf(Out("at_once")).size());
  }
  // And the map of maps is an input again.
  const CommandResult third = Replay(Out("joined").string(), "again");
  ASSERT_EQ(third.exit_code, 0) << third.output;
  EXPECT_LT(LargestDifference(PosesOf(Out("again")), PosesOf(Out("joined"))), 1e-6);
  EXPECT_THAT(NamesOf(ReportOf(Out("again"))["dives"]),
              ElementsAre("joined: C", "joined: AB: dive1", "joined: AB: dive2"));
}

TEST_F(FinishedMaps, TheSameInputsGiveTheSameBytes) {
  ASSERT_EQ(Replay("AB dive3", "one").exit_code, 0);
  ASSERT_EQ(Replay("AB dive3", "two").exit_code, 0);
  for (const char* const file :
       {"elevation.tif", "poses.txt", "track.csv", "graph.g2o", "survey.bin"})
    EXPECT_TRUE(TextOf(Out("one") / file) == TextOf(Out("two") / file)) << file;
}

TEST_F(FinishedMaps, AnotherMapOriginMovesNothingOnTheEarth) {
  // 8 km south-east of the survey, where north is turned by 0.05 degrees.
  ASSERT_EQ(Replay("AB --datum 43.02,-70.63", "moved").exit_code, 0);
  EXPECT_NEAR(ReportOf(Out("moved"))["datum"]["latitude_deg"], 43.02, 1e-9);
  EXPECT_LT(LargestDistanceM(TrackOf(Out("moved")), TrackOf(Folder() / "AB")), 0.01);
  EXPECT_NEAR(ShapeOf(Out("moved")), ShapeOf(Folder() / "AB"), 1e-3);
  // There and back, joined with a dive that states the first origin.
  const CommandResult back = Replay("dive3 " + Out("moved").string(), "back");
  ASSERT_EQ(back.exit_code, 0) << back.output;
  ASSERT_EQ(Replay("dive3 dive1 dive2", "at_once").exit_code, 0);
  EXPECT_LT(LargestDistanceM(TrackOf(Out("back")), TrackOf(Out("at_once"))), 0.02);
}

TEST_F(FinishedMaps, NoDiveCountsTwice) {
  Folder();
  ExpectOneLine(Replay("A A/"), 64, "A/: given twice");
  const std::string twice = "its dive is in A, too; leave one of them out";
  EXPECT_THAT(Replay("A AB").output, HasSubstr("AB: " + twice));
  EXPECT_EQ(Replay("A AB").exit_code, 64);
  const CommandResult log = Replay("A dive3 dive1");
  EXPECT_EQ(log.exit_code, 64) << log.output;
  EXPECT_THAT(log.output, HasSubstr("dive1: " + twice));
  EXPECT_FALSE(fs::exists(Out()));
}

TEST_F(FinishedMaps, OneThatCannotBeUsedSaysWhyInOneLine) {
  const fs::path older = CopyOf("A", "older");
  fs::remove(older / "survey.bin");
  ExpectOneLine(
      Replay(older.string()), 65, "this map has no survey.bin: it is of an older version");

  const fs::path damaged = CopyOf("A", "damaged");
  std::string bytes = TextOf(damaged / "survey.bin");
  bytes[bytes.size() / 2] ^= 1;
  Write(damaged / "survey.bin", bytes);
  ExpectOneLine(Replay(damaged.string()), 65, "survey.bin: damaged");
  Write(damaged / "survey.bin", bytes.substr(0, bytes.size() / 3));
  ExpectOneLine(Replay(damaged.string()), 65, "survey.bin: damaged");
  Write(damaged / "survey.bin", "");
  ExpectOneLine(Replay(damaged.string()), 65, "survey.bin: not a file of a map");

  const fs::path newer = CopyOf("A", "newer");
  bytes = TextOf(newer / "survey.bin");
  bytes[bytes.find('\n') + 1] = 99;
  Write(newer / "survey.bin", bytes);
  ExpectOneLine(Replay(newer.string()), 65, "of another version of Seastitch");

  // Among others it is left out and named.
  const CommandResult others = Replay(damaged.string() + " dive1 dive2");
  ASSERT_EQ(others.exit_code, 0) << others.output;
  EXPECT_EQ(ReportOf(Out())["dives_not_read"][0]["name"], "damaged");
  EXPECT_EQ(ReportOf(Out())["submaps"], ReportOf(Folder() / "AB")["submaps"]);
}

TEST_F(FinishedMaps, OptionsThatNeedTheFilesOfItsDivesAreRefused) {
  Folder();
  ExpectOneLine(Replay("A dive3 --soundings las"), 64, "a finished map holds no single soundings");
  Write(Folder() / "tide.csv", "2026-05-02T10:00:00Z,1.2\n");
  ExpectOneLine(Replay("A dive3 --water-level tide.csv"), 64, "depths of a finished map");
  ExpectOneLine(Replay("A --as-recorded"), 64, "--as-recorded needs the logs of one dive");
  ExpectOneLine(Replay("A --from-raw"), 64, "--from-raw needs a log");
  ExpectOneLine(Run(Folder(), "A --out A"), 64, "choose another folder");
}

TEST_F(FinishedMaps, ASubmapWithoutItsPointsStaysInTheGraphAndIsNamed) {
  const fs::path map = CopyOf("AB", "AB");
  fs::remove(map / "submaps/submap_3.pcd");
  std::string points = TextOf(map / "submaps/submap_5.pcd");
  points[points.size() - 7] ^= 4;
  Write(map / "submaps/submap_5.pcd", points);
  const CommandResult result = Replay(map.string() + " dive3");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("submap_3.pcd: cannot be read"));
  EXPECT_THAT(result.output, HasSubstr("submap_5.pcd: not as the replay wrote it"));
  const nlohmann::json report = ReportOf(Out());
  EXPECT_EQ(report["refused"]["submaps_of_a_map_without_their_points"], 2);
  EXPECT_EQ(report["submaps"], 10);
  EXPECT_EQ(report["dives"][1]["closures_with"]["AB: dive1"],
            ReportOf(Folder() / "AB")["dives"][1]["closures_with"]["dive1"]);
  EXPECT_FALSE(fs::exists(Out() / "submaps/submap_3.pcd"));
  // None of its points: nothing to map.
  fs::remove_all(map / "submaps");
  fs::create_directory(map / "submaps");
  const CommandResult none = Replay(map.string(), "none");
  EXPECT_EQ(none.exit_code, 65) << none.output;
  EXPECT_FALSE(fs::exists(Out("none")));
}

TEST_F(FinishedMaps, ThoseOfImportedSubmapsHaveNoPlaceOnTheEarth) {
  fs::create_directories(Out("pcd"));
  for (const auto& file : fs::directory_iterator(Folder() / "AB/submaps"))
    fs::copy(file.path(), Out("pcd"));
  ASSERT_EQ(Replay(Out("pcd").string(), "imported").exit_code, 0);
  ExpectOneLine(Replay(Out("imported").string()), 65, "has no map origin");
  ExpectOneLine(Replay("A " + Out("pcd").string()), 64, "mapped by itself: it has no map origin");
}

TEST_F(FinishedMaps, WhatAMapLacksIsPassedOn) {
  fs::create_directories(Out("notes"));
  Write(Out("notes") / "weather.txt", "calm");
  ASSERT_EQ(Replay("dive1 dive2 " + Out("notes").string(), "lacks").exit_code, 0);
  ASSERT_EQ(Replay(Out("lacks").string() + " dive3").exit_code, 0);
  const nlohmann::json unread = ReportOf(Out())["dives_not_read"];
  ASSERT_EQ(unread.size(), 1u);
  EXPECT_EQ(unread[0]["name"], "lacks: notes");
  EXPECT_THAT(std::string(unread[0]["reason"]), HasSubstr("weather.txt"));
}

TEST_F(FinishedMaps, InfoListsWhatItHolds) {
  const std::string info = Program("seastitch") + " info ";
  const CommandResult text = RunCommand(info + (Folder() / "AB").string());
  ASSERT_EQ(text.exit_code, 0) << text.output;
  EXPECT_THAT(text.output, HasSubstr("AB: dive2: 5 submaps, pings from 20"));
  EXPECT_THAT(text.output, HasSubstr("9 loop closures accepted, 3 registrations rejected"));
  EXPECT_THAT(text.output, Not(HasSubstr("points are left out")));

  const fs::path map = CopyOf("AB", "AB");
  fs::remove(map / "submaps/submap_3.pcd");
  const CommandResult json = RunCommand(info + "--json " + map.string());
  ASSERT_EQ(json.exit_code, 0) << json.output;
  const auto content = nlohmann::json::parse(json.output);
  EXPECT_EQ(content["dives"][0]["submaps"], 2);
  ASSERT_EQ(content["points_unusable"].size(), 1u);
  fs::remove(map / "survey.bin");
  EXPECT_EQ(RunCommand(info + map.string()).exit_code, 65);
}

// Bytes that no replay wrote, with a checksum that fits: a map, or DataError.
TEST_F(FinishedMaps, NoContentOfTheFileHarms) {
  const fs::path map = CopyOf("AB", "AB");
  const std::string good = TextOf(map / "survey.bin");
  const std::size_t crc_at = good.find('\n') + 1 + 2 * sizeof(std::uint32_t);
  const std::size_t content_at = crc_at + sizeof(std::uint32_t);
  int refused = 0;
  std::uint32_t random = 1;
  const auto next = [&random] { return random = 1664525u * random + 1013904223u; };
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string bytes = good;
    for (int flip = 0; flip < 1 + trial % 3; ++flip) {
      const std::size_t at = content_at + next() % (bytes.size() - content_at);
      bytes[at] = static_cast<char>(next() >> 24);
    }
    if (trial % 5 == 0) bytes.resize(content_at + next() % (bytes.size() - content_at));
    boost::crc_32_type crc;
    crc.process_bytes(bytes.data() + content_at, bytes.size() - content_at);
    const std::uint32_t sum = crc.checksum();
    std::memcpy(bytes.data() + crc_at, &sum, sizeof sum);
    Write(map / "survey.bin", bytes);
    try {
      ReadFinishedMap(map, "map");
    } catch (const DataError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, kTrials / 5);
}

}  // namespace
}  // namespace seastitch
