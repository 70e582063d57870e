// Which survey files are one dive, and what becomes of those that are not.
#include "survey/plan/survey_groups.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/read_all.hpp"
#include "tests/survey/files/small_kmall.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kHourS = 3600.0;

// A small file that begins at from_s, with another text in its installation. (`Kmall` moves north
// by 1.1 m/s, so that files a long time apart are far apart too, at a usual speed.)
std::string File(double from_s, const std::string& text = "", const std::string& by = "") {
  Kmall kmall;
  kmall.Survey(from_s);
  if (!text.empty()) kmall.Replace(text, by);
  return kmall.bytes();
}

struct Pair {
  const char* what;
  std::string first, second;
  std::size_t dives, dives_of_one;  // without and with one_dive
};

TEST(SurveyGroups, AreOfOneSonarWithoutAPauseAJumpOrAMove) {
  const std::string transmitter = "TRAI_TX1:X=0.000000", motion = "ATTI_1:X=0.000000";
  Kmall without;  // begins in the middle of a line: no installation
  for (int i = 0; i < 5; ++i) without.Motion(i).Position(i).Ping(i + 0.5);
  // Before the clock and the receiver are right.
  Kmall with_stamp, with_place;
  with_stamp.Installation().Position(-1e8);
  with_place.Installation().PositionAt(kHourS, {Deg2Rad(-10.0), Deg2Rad(20.0)});
  for (Kmall* const kmall : {&with_stamp, &with_place})
    for (int i = 0; i < 20; ++i)
      kmall->Motion(kHourS + i).Position(kHourS + i + 0.1).Ping(kHourS + i + 0.5);
  const std::vector<Pair> pairs{
      {"lines", File(0.0), File(kHourS), 1, 1},
      {"a lunch break", File(0.0), File(3.0 * kHourS), 1, 1},
      {"a night", File(0.0), File(13.0 * kHourS), 2, 1},
      {"a moved transmitter", File(0.0), File(kHourS, transmitter, "TRAI_TX1:X=0.100000"), 2, 1},
      {"a moved sensor", File(0.0), File(kHourS, motion, "ATTI_1:X=0.100000"), 2, 1},
      {"rounding", File(0.0), File(kHourS, motion, "ATTI_1:X=0.001000"), 1, 1},
      {"another water line", File(0.0), File(kHourS, "SWLZ=0.000000", "SWLZ=1.000000"), 1, 1},
      {"a serial number and none",
       File(0.0),
       File(kHourS, "D=0.000;,TRAI_RX1", "N=77777;,TRAI_RX1"),
       1,
       1},
      {"two serial numbers",
       File(0.0, "D=0.000;,TRAI_RX1", "N=77776;,TRAI_RX1"),
       File(kHourS, "D=0.000;,TRAI_RX1", "N=77777;,TRAI_RX1"),
       2,
       2},
      {"no installation", File(kHourS), without.bytes(), 1, 1},
      {"no record with a time", File(0.0), Kmall().Installation().bytes(), 1, 1},
      {"one wrong stamp at the begin", File(0.0), with_stamp.bytes(), 1, 1},
      {"one wrong position at the begin", File(0.0), with_place.bytes(), 1, 1},
  };
  for (const Pair& pair : pairs) {
    SCOPED_TRACE(pair.what);
    const TemporaryDir dir;
    const std::vector<fs::path> files{dir.Write("b.kmall", pair.second),
                                      dir.Write("a.kmall", pair.first)};
    const auto dives = GroupSurveyFiles(files, false);
    EXPECT_EQ(dives.size(), pair.dives);
    EXPECT_EQ(GroupSurveyFiles(files, true).size(), pair.dives_of_one);
    EXPECT_TRUE(dives.size() > 1 || dives[0].files == files) << "in the order given";
    EXPECT_EQ(dives.back().reason.empty(), pair.dives == pair.dives_of_one);
  }
}

// One file states no serial number: it does not make one sonar of two.
TEST(SurveyGroups, TwoSerialNumbersAreTwoSonarsWhateverAThirdFileLacks) {
  const TemporaryDir dir;
  const std::string place = "D=0.000;,TRAI_RX1";
  const auto dives =
      GroupSurveyFiles({dir.Write("a.kmall", File(0.0)),
                        dir.Write("b.kmall", File(kHourS, place, "N=77776;,TRAI_RX1")),
                        dir.Write("c.kmall", File(2.0 * kHourS, place, "N=77777;,TRAI_RX1"))},
                       false);
  EXPECT_EQ(dives.size(), 2u);
}

TEST(SurveyGroups, NoVehicleIsFasterThanTwentyMetresASecond) {
  const TemporaryDir dir;
  const auto first = dir.Write("a.kmall", File(0.0));
  const auto dives = [&](double from_s, double latitude_deg) {
    Kmall kmall;
    kmall.Installation();
    const GeoPosition place{Deg2Rad(latitude_deg), Deg2Rad(5.0)};
    for (int i = 0; i < 5; ++i)
      kmall.Motion(from_s + i).PositionAt(from_s + i, place).Ping(from_s + i + 0.5);
    return GroupSurveyFiles({first, dir.Write("b.kmall", kmall.bytes())}, false).size();
  };
  EXPECT_EQ(dives(1000.0, 57.17), 1u) << "19 km in 1,000 s";
  EXPECT_EQ(dives(1000.0, 57.2), 2u) << "22 km";
  EXPECT_EQ(dives(-1000.0, 57.2), 2u) << "the other way";
  EXPECT_EQ(dives(0.0, 57.004), 1u) << "two recorders of one ship";
}

TEST(SurveyGroups, FilesOfOneShipAreOneDive) {
  for (const char* name :
       {"em2040_OS01.kmall", "em2040_eg.kmall", "em710_g.all", "gsf_v3_08.gsf"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    EXPECT_EQ(GroupSurveyFiles({file}, false).size(), 1u) << name;
  }
}

// A folder with the files of two ships in two oceans: no installation is used for the other's
// pings.
TEST(TwoShips, FarApartAreTwoSurveys) {
  const fs::path kongsberg = Shared("data/mbes/em2040_OS01.kmall");
  const fs::path r2sonic = Shared("data/mbes/r2sonic2026.xtf");
  SKIP_WITHOUT(kongsberg);
  const TemporaryDir dir;
  fs::create_directories(dir.path() / "in");
  fs::copy_file(kongsberg, dir.path() / "in" / "a.kmall");
  fs::copy_file(r2sonic, dir.path() / "in" / "b.xtf");
  const auto groups = GroupSurveyFiles({dir.path() / "in/a.kmall", dir.path() / "in/b.xtf"}, false);
  ASSERT_EQ(groups.size(), 2u);
  const CommandResult both = Replay((dir.path() / "in").string(), dir.path() / "both");
  EXPECT_EQ(both.exit_code, 65) << both.output;
  EXPECT_THAT(both.output, HasSubstr("in/a.kmall' --out"));
  EXPECT_THAT(both.output, HasSubstr("in/b.xtf' --out"));
  EXPECT_FALSE(fs::exists(dir.path() / "both"));
}

TEST(TwoShips, AMapOriginFarFromTheFilesIsRefused) {
  const fs::path file = Shared("data/mbes/em2040_OS01.kmall");  // 51.24, 2.92
  SKIP_WITHOUT(file);
  const TemporaryDir dir;
  const CommandResult far = Replay(file.string() + " --datum 10,20", dir.path() / "map");
  EXPECT_EQ(far.exit_code, 64) << far.output;
  const CommandResult swapped = Replay(file.string() + " --datum 2.9,51.2", dir.path() / "map");
  EXPECT_EQ(swapped.exit_code, 64);
  EXPECT_THAT(swapped.output, HasSubstr("latitude comes first"));
}

// The second file's vessel is 1 m higher out of the water: its soundings are 1 m less deep.
TEST(WaterLine, IsFollowedFromTheTimeOfTheRecord) {
  const TemporaryDir dir;
  const auto depths_of = [](const std::vector<fs::path>& files) {
    SurveyFiles survey(PlanSurvey(files));
    std::vector<double> depths_m;
    ReadAll(
        &survey,
        [](const NavigationSample&) {},
        [&](const DepthSample& sample) { depths_m.push_back(sample.depth_m); });
    return depths_m;
  };
  const std::vector<fs::path> files{
      dir.Write("1.kmall", File(0.0)),
      dir.Write("2.kmall", File(kHourS, "SWLZ=0.000000", "SWLZ=1.000000"))};
  const std::vector<double> depths_m = depths_of(files);
  ASSERT_GT(depths_m.size(), 10u);
  EXPECT_NEAR(depths_m.front() - depths_m.back(), 1.0, 1e-6);
  const SurveyPlan plan = PlanSurvey(files);
  EXPECT_THAT(plan.Text(), HasSubstr("1.000 m down from 2.kmall on"));
  EXPECT_TRUE(plan.warnings.empty());
}

// A R2Sonic line has no profile: rays are straight, which changes depths.
TEST(Warnings, AreInTheReportAndFailTheCommandWhereThatIsAskedFor) {
  const fs::path file = Shared("data/mbes/r2sonic2026.xtf");
  SKIP_WITHOUT(file);
  const TemporaryDir dir;
  const fs::path out = dir.path() / "map";
  const CommandResult usual = Replay(file.string(), out);
  EXPECT_EQ(usual.exit_code, 0) << usual.output;
  EXPECT_THAT(usual.output, HasSubstr("warning: no sound speed profile"));
  const auto report = nlohmann::json::parse(std::ifstream(out / "report.json"));
  ASSERT_EQ(report["warnings"].size(), 1u);
  EXPECT_EQ(report["warnings"][0]["code"], NameOf(WarningCode::kNoSoundSpeedProfile));
  const CommandResult strict = Replay(file.string() + " --fail-on-warning", out);
  EXPECT_EQ(strict.exit_code, 3) << strict.output;
}

}  // namespace
}  // namespace seastitch
