// Which navigation, depth and soundings a replay uses where a survey's files state several, some of
// them seldom or wrongly.
#include <gmock/gmock.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "survey/plan/ping_losses.hpp"
#include "survey/plan/survey_plan.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/read_all.hpp"
#include "tests/survey/files/small_kmall.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

std::uint32_t NumberAt(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

// The datagrams of a .kmall or .all, changed by `change`, without those for which it is false.
std::string Changed(const fs::path& file, const std::function<bool(std::string*)>& change) {
  const std::string all = TextOf(file);
  const std::size_t beside = file.extension() == ".all" ? 4 : 0;  // .all: size without itself
  std::string changed;
  for (std::size_t at = 0; at + 20 < all.size();) {
    std::string datagram = all.substr(at, NumberAt(all, at) + beside);
    at += datagram.size();
    if (change(&datagram)) changed += datagram;
  }
  return changed;
}

double OffMaker(const fs::path& file) {
  return CompareWithMaker(PlanSurvey({file}), 1000).RmsPercent().norm();
}

// --- sources that are there for a part only ------------------------------------------------------

TEST(SurveySources, APositionSystemOfAFewRecordsDoesNotHideAnother) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0).Position(0.0).Position(1.0);
  for (int i = 0; i < 20; ++i) kmall.Motion(i, 0, 20, true).Ping(i + 0.5);
  const Played played({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(played.survey.plan().position_source, "#SKM0");
  EXPECT_EQ(played.Count("survey_pings_without_position"), 0);
}

// A .s7k of 20 s: ten times a second roll of 0.01 rad, pitch and heave, once a second a heading.
std::string WithSlowHeading() {
  std::string bytes;
  const auto record = [&bytes](std::uint32_t type, double t_s, std::vector<float> values) {
    ByteWriter data;
    for (const float value : values) data.Le(value);
    const auto encoded = EncodeS7kRecord(type, S7kPingId{}, Kmall::At(t_s), data.bytes());
    bytes.append(encoded.begin(), encoded.end());
  };
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 10; ++k) record(1012, i + 0.1 * k, {0.01f, 0.0f, 0.1f});
    record(1013, i, {1.0f});
    MbesPing ping;
    ping.time = Kmall::At(i + 0.5);
    ping.ping_number = static_cast<std::uint32_t>(i);
    ping.sound_speed_mps = 1500.0;
    ping.beams.resize(50, {0.02f, 0.1f, 0, 0, 0, -20, kBeamValid | kBeamPhase});
    for (const auto& part : {EncodeS7k7000(S7kPingId{}, ping.time, ping.sound_speed_mps),
                             EncodeS7k7027(S7kPingId{}, ping)})
      bytes.append(part.begin(), part.end());
  }
  return bytes;
}

TEST(SurveySources, OneAttitudeDoesNotHideRollAndPitchBesideAHeading) {
  TemporaryDir dir;
  NavigationRecord attitude;
  attitude.time = Kmall::At(0.0);
  attitude.attitude = Attitude{};
  attitude.heave_m = 0.0;
  const auto one = EncodeS7k1016({attitude});
  const SurveyPlan plan =
      MakeSurveyPlan({dir.Write("a.s7k", std::string(one.begin(), one.end()) + WithSlowHeading())});
  EXPECT_EQ(plan.attitude_source, "1012");
  EXPECT_EQ(plan.heading_source, "1013");
}

// GSF: attitude records for one ping of eight, and every ping has its own.
TEST(SurveySources, AttitudeOfOnePingDoesNotHideThatOfEveryPing) {
  const fs::path file = Shared("data/mbes/gsf_v3_08.gsf");
  SKIP_WITHOUT(file);
  const std::string all = TextOf(file);
  const auto number_at = [&all](std::size_t at) {
    return static_cast<std::uint32_t>(__builtin_bswap32(NumberAt(all, at)));
  };
  std::string few;
  int attitudes = 0;
  for (std::size_t at = 0; at + 8 < all.size();) {
    constexpr std::uint32_t kAttitude = 12;
    const std::size_t bytes = 8 + number_at(at) + (number_at(at + 4) >> 31 != 0 ? 4 : 0);
    const bool attitude = (number_at(at + 4) & 0x3FFFFF) == kAttitude;
    if (!attitude || ++attitudes == 1) few += all.substr(at, bytes);
    at += bytes;
  }
  TemporaryDir dir;
  const Played played({dir.Write("a.gsf", few)});
  EXPECT_EQ(played.survey.plan().attitude_source, "gsf_ping");
  EXPECT_EQ(played.Count("survey_pings_without_attitude"), 0);
}

// Positions of system 0 end after a third of the survey, and those of system 1 begin.
TEST(SurveySources, AnotherPositionSystemTakesOverWhereTheFirstEnds) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 60; ++i) kmall.Motion(i).Position(i, i < 40 ? 0 : 1).Ping(i + 0.5);
  const Played played({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(played.survey.plan().position_source, "#SPO0");
  EXPECT_EQ(played.Count("survey_positions_of_another_source"), 15);
  EXPECT_LE(played.Count("survey_pings_without_position"), 5);
}

// An SBET of the first half. It states attitude too, which replaces the sensor's.
TEST(SurveySources, TheFilesOwnNavigationTakesOverWhereAnSbetEnds) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 200; ++i) kmall.Motion(i).Position(i).Ping(i + 0.5);
  std::string sbet;
  constexpr double kWeekS = 561'618.0;  // GPS time of kNoon
  for (int i = 0; i < 2000; ++i) {
    std::array<double, 17> row{};
    row[0] = kWeekS + 0.05 * i;
    row[1] = Deg2Rad(57.0 + 1e-5 * 0.05 * i);
    row[2] = Deg2Rad(5.0);
    sbet.append(reinterpret_cast<const char*>(row.data()), sizeof row);
  }
  const Played played({dir.Write("a.kmall", kmall.bytes()), dir.Write("b.sbet", sbet)});
  EXPECT_EQ(played.survey.plan().position_source, "sbet");
  EXPECT_EQ(played.survey.plan().attitude_source, "sbet");
  EXPECT_EQ(played.Count("survey_positions_of_another_source"), 40);
  EXPECT_EQ(played.Count("survey_attitudes_of_another_source"), 800);
  EXPECT_LE(played.Count("survey_pings_without_position"), 62);
  EXPECT_LE(played.Count("survey_pings_without_attitude"), 62);
}

// --- what the sonar itself has made of its times and angles --------------------------------------

TEST(SurveySources, NavigationOfAnotherYearBesideTheFilesIsRefused) {
  TemporaryDir dir;
  const fs::path survey = dir.Write("a.kmall", Kmall().Survey().bytes());
  const std::string columns =
      "delimiter: comma\ncolumns:\n  - {quantity: iso, column: 1}\n"
      "  - {quantity: latitude, column: 2}\n  - {quantity: longitude, column: 3}\n";
  for (const std::string year : {"2026", "2025"}) {
    std::string lines;
    for (int i = 0; i < 6; ++i)
      lines += year + "-05-02T12:00:0" + std::to_string(i) + "Z,57.0,5.0\n";
    const fs::path text = dir.Write("track.csv", lines);
    dir.Write("track.csv.yaml", columns);
    const std::string outcome = Played({survey, text}).survey.Outcome().value_or("mapped");
    EXPECT_THAT(
        outcome,
        HasSubstr(year == "2026" ? "mapped"
                                 : "none of its 5 pings lies within a minute of a position"));
  }
}

// A track of 20 s, once a second, with a position of no receiver's fix at its end.
fs::path TrackIn(const TemporaryDir& dir) {
  std::string lines;
  for (int i = 0; i < 20; ++i)
    lines += "2026-05-02T12:00:" + std::string(i < 10 ? "0" : "") + std::to_string(i) + "Z," +
             std::to_string(57.0 + 1e-5 * i) + ",5.0\n";
  dir.Write("track.csv.yaml",
            "delimiter: comma\ncolumns:\n  - {quantity: iso, column: 1}\n"
            "  - {quantity: latitude, column: 2}\n  - {quantity: longitude, column: 3}\n");
  return dir.Write("track.csv", lines + "2026-05-02T12:00:20Z,0.0,0.0\n");
}

TEST(SurveySources, APositionAtZeroIsNoneInTextEither) {
  TemporaryDir dir;
  const Played played({dir.Write("a.kmall", Kmall().Survey().bytes()), TrackIn(dir)});
  EXPECT_EQ(played.Count("survey_positions_at_zero"), 1);
}

// Soundings by line that are not used, beside raw pings.
TEST(SurveySources, UnusedLinesLeaveAttitudeAndDepthOfRawPings) {
  TemporaryDir dir;
  std::string points;
  for (int i = 0; i < 20; ++i) points += "5.0 " + std::to_string(57.0 + 1e-5 * i) + " -10.0\n";
  const fs::path lines = dir.Write("b.xyz", points), track = TrackIn(dir);
  const fs::path slow = dir.Write("a.s7k", WithSlowHeading());
  Kmall kmall;  // depth: that of each ping
  kmall.Installation().Profile(0.0).Heave(0.0);
  for (int i = 0; i < 20; ++i) kmall.Motion(i).Position(i).Ping(i + 0.5);
  for (const fs::path& file : {slow, fs::path(dir.Write("a.kmall", kmall.bytes()))}) {
    const Played alone({file, track}), beside({file, track, lines});
    EXPECT_GT(beside.Count("survey_pings_not_used"), 0) << file;
    EXPECT_EQ(beside.survey.plan().level_track, nullptr) << file;
    EXPECT_EQ(beside.survey.plan().attitude_source, alone.survey.plan().attitude_source) << file;
    EXPECT_EQ(beside.samples, alone.samples) << file;
  }
}

// A heave goes on where another motion sensor takes over.
TEST(SurveySources, HeaveOfTheMotionSensorThatTakesOverIsUsed) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 100; ++i) {
    if (i < 91) kmall.Motion(i, 0, 30);
    kmall.Motion(i, 1).Position(i).Ping(i + 0.5);
  }
  const Played played({dir.Write("a.kmall", kmall.bytes())});
  ASSERT_EQ(played.survey.plan().attitude_source, "#SKM0");
  EXPECT_GT(played.samples.at("depth"), 91 * 30) << "some of the second sensor";
}

// Soundings of X and D are level: the heading that each ping states suffices.
TEST(SurveySources, SoundingsOfAllWithoutAnAttitudeLieWhereTheirHeadingPutsThem) {
  for (const char* const name : {"d.all", "x.all"}) {
    const fs::path file = Shared("cases/all_soundings_without_attitude") / name;
    SKIP_WITHOUT(file);
    SurveyFiles survey(MakeSurveyPlan({file}));
    EXPECT_EQ(survey.plan().Problem(), std::nullopt) << name;
    double depth_m = 0.0, sum_m = 0.0;
    int soundings = 0;
    ReadAll(
        &survey,
        [&](const DepthSample& sample) { depth_m = sample.depth_m; },
        [&](const NavigationSample& sample) {
          if (!sample.attitude) return;
          const Eigen::Vector3d ahead = sample.attitude->q_ned_imu * Eigen::Vector3d::UnitX();
          EXPECT_NEAR(ahead.y(), 1.0, 1e-6) << "east";
        },
        [&](const SoundingPing& ping) {
          for (const auto& sounding : ping.soundings) {
            sum_m += depth_m + double{sounding.p_level_m.z()};
            ++soundings;
          }
        });
    ASSERT_EQ(soundings, 1300) << name;
    EXPECT_NEAR(sum_m / soundings, 20.0, 0.01) << name;
  }
}

TEST(SurveyDepth, AHeaveThatIsAlwaysZeroIsNone) {
  const fs::path file = Shared("data/mbes/em2040c_ay.all");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  // Without the attitude datagram A: the network attitude n has a heave of 0.
  const fs::path changed =
      dir.Write("a.all", Changed(file, [](std::string* d) { return (*d)[5] != 'A'; }));
  EXPECT_EQ(MakeSurveyPlan({changed}).depth, SurveyPlan::Depth::kPing);
  EXPECT_LT(OffMaker(changed), 0.1);
}

// Echoes come seconds after a ping: navigation needs a depth for their times.
TEST(SurveyDepth, DepthsOfSlowPingsAreAtMostASecondApart) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0).Heave(0.0);
  for (int i = 0; i < 30; ++i) {
    kmall.Motion(i).Position(i);
    if (i % 5 == 0) kmall.Ping(i + 0.5);
  }
  SurveyFiles survey(MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())}));
  ASSERT_EQ(survey.plan().depth, SurveyPlan::Depth::kPing);
  std::vector<double> times_s;
  ReadAll(&survey, [&](const DepthSample& sample) {
    times_s.push_back(1e-6 * static_cast<double>(ToUtime(sample.time) - kNoon));
  });
  ASSERT_GT(times_s.size(), 20u);
  EXPECT_NEAR(times_s.front(), 0.5, 1e-6);
  EXPECT_NEAR(times_s.back(), 25.5, 1e-6);
  for (std::size_t i = 1; i < times_s.size(); ++i) {
    EXPECT_GT(times_s[i], times_s[i - 1]);
    EXPECT_LE(times_s[i], times_s[i - 1] + 1.0);
  }
}

// An AUV at 100 m: its water line is stated with every ping, and its heave is small.
TEST(SurveyDepth, ThatOfTheSonarIsUsedWhereHeaveIsFarOff) {
  const fs::path file = Shared("data/mbes/em2040_eg.kmall");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const fs::path auv =
      dir.Write("a.kmall", Changed(file, [](std::string* d) {
                  constexpr std::size_t kWaterLine = 36 + 108;
                  if (d->substr(4, 4) != "#MRZ") return true;
                  float water_line_m = 0.0f;
                  std::memcpy(&water_line_m, d->data() + kWaterLine, sizeof water_line_m);
                  water_line_m -= 100.0f;
                  std::memcpy(d->data() + kWaterLine, &water_line_m, sizeof water_line_m);
                  return true;
                }));
  const SurveyPlan plan = PlanSurvey({auv});
  EXPECT_EQ(plan.depth, SurveyPlan::Depth::kPing);
  EXPECT_TRUE(plan.raw_pings);
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_EQ(plan.warnings[0].code, WarningCode::kDepthOfPings);
  EXPECT_LT(OffMaker(auv), 0.1);
}

// A sonar that places no soundings fills in zeros, which are no soundings at 100 m either.
TEST(SurveyDepth, ZerosAreNoSoundingsToCompareWith) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 20; ++i) kmall.Motion(i).Position(i).Ping(i + 0.5);
  const fs::path file = dir.Write("a.kmall", kmall.bytes());
  const fs::path deep = dir.Write("b.kmall", Changed(file, [](std::string* d) {
                                    constexpr std::size_t kWaterLine = 36 + 108;
                                    const float water_line_m = -100.0f;
                                    if (d->substr(4, 4) == "#MRZ")
                                      std::memcpy(d->data() + kWaterLine, &water_line_m, 4);
                                    return true;
                                  }));
  EXPECT_EQ(CompareWithMaker(MakeSurveyPlan({deep}), 50).beams(), 0);
  EXPECT_TRUE(PlanSurvey({deep}).raw_pings);
}

TEST(SurveyDepth, WithoutAnInstallationTheSonarsOwnSoundingsAreUsed) {
  const fs::path file = Shared("data/mbes/em2040_OS01.kmall");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const fs::path without =
      dir.Write("a.kmall", Changed(file, [](std::string* d) { return d->substr(4, 4) != "#IIP"; }));
  const Played played({without});
  EXPECT_FALSE(played.survey.plan().raw_pings);
  EXPECT_EQ(played.samples.count("mbes_ping"), 0u);
  EXPECT_GT(played.samples.at("mbes_soundings"), 0);
  // Named also by a replay that is quiet.
  const CommandResult replay = Replay(without.string(), dir.path() / "map");
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_THAT(replay.output, HasSubstr("warning: the sonar's own soundings are used"));
  // A vehicle.yaml may state the installation.
  EXPECT_TRUE(PlanSurvey({without}, true).raw_pings);
  EXPECT_THAT(PlanSurvey({file}).Text(), Not(HasSubstr("warning")));
}

// --- places --------------------------------------------------------------------------------------

// A grid's northing of thousands of kilometres must not shorten its metres.
TEST(SurveyGrid, DistancesAreThoseOfTheGrid) {
  SurveyPlan plan;
  const Eigen::Vector2d start_m(6'375'000.0, 325'000.0);
  plan.grid_origin_m = start_m;
  constexpr double kDegreeM = 110'574.0, kDegreeEastM = 111'320.0;  // at latitude 0
  const GeoPosition far = plan.FromGrid(start_m + Eigen::Vector2d(387.0, 387.0));
  EXPECT_NEAR(Rad2Deg(far.latitude_rad) * kDegreeM, 387.0, 0.1);
  EXPECT_NEAR(Rad2Deg(far.longitude_rad) * kDegreeEastM, 387.0, 0.1);
  // Beside a survey that begins 1 km to the south.
  plan.UseGridOrigin(start_m - Eigen::Vector2d(1000.0, 0.0));
  EXPECT_NEAR(Rad2Deg(plan.vehicle.datum.latitude_rad) * kDegreeM, 1000.0, 0.1);
}

// Text in a grid beside files that have latitude and longitude.
TEST(SurveyGrid, TextOfAGridPlacesFilesThatHavePositions) {
  TemporaryDir dir;
  std::string lines;
  for (int i = 0; i < 5; ++i)
    lines += "2026-05-02T12:00:0" + std::to_string(i) + "Z,6375000.0,325000.0\n";
  const std::string grid = dir.Write("grid.csv", lines);
  dir.Write("grid.csv.yaml",
            "delimiter: comma\ncolumns:\n  - {quantity: iso, column: 1}\n"
            "  - {quantity: north, column: 2}\n  - {quantity: east, column: 3}\n");
  const SurveyPlan plan = MakeSurveyPlan({dir.Write("a.kmall", Kmall().Survey().bytes()), grid});
  EXPECT_EQ(plan.position_source, "text");
  EXPECT_EQ(plan.vehicle.datum.latitude_rad, 0.0);
  EXPECT_THAT(plan.Text(), HasSubstr("6375000.000 north, 325000.000 east"));
}

// --- what is lost --------------------------------------------------------------------------------

TEST(PingLosses, AreNamedBelowNinetyNineHundredths) {
  PingTally lost;
  lost.Add(PingLoss::kWithoutPose, 7);
  const PingLosses few(1000, lost, 0);
  EXPECT_EQ(few.text, "993 of 1000 pings used");
  EXPECT_FALSE(few.is_warning);
  lost.Add(PingLoss::kOutOfOrder, 300);
  const PingLosses many(1000, lost, 0);
  EXPECT_EQ(many.text,
            "693 of 1000 pings used: 300 because they came after a later ping was used; 7 "
            "because navigation has no pose at their times");
  EXPECT_TRUE(many.is_warning);
}

TEST(PingLosses, AreNamedByAQuietReplay) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey();
  for (int i = 0; i < 20; ++i) kmall.Ping(6.0 + i);  // without navigation
  const std::string file = dir.Write("a.kmall", kmall.bytes());
  const CommandResult replay = Replay(file, dir.path() / "map");
  EXPECT_THAT(replay.output, HasSubstr("warning: 5 of 25 pings used: "));
}

// Pings of a clock that was not set come before everything else.
TEST(PingLosses, PingsLongBeforeNavigationAreWithoutPosition) {
  TemporaryDir dir;
  Kmall pings, navigation;
  pings.Profile(0.0);
  navigation.Installation();
  for (int i = 0; i < 5; ++i) {
    pings.Ping(i);
    navigation.Motion(8e6 + i).Position(8e6 + i);
  }
  const Played played(
      {dir.Write("a.kmall", pings.bytes()), dir.Write("b.kmall", navigation.bytes())});
  EXPECT_EQ(played.Count("survey_pings_without_position"), 5);
  ASSERT_TRUE(played.survey.Outcome());
  EXPECT_THAT(*played.survey.Outcome(), HasSubstr("within 2 s of a position"));
}

TEST(SurveyLosses, FilesWithoutContentDoNotEndTheReplayOfOthers) {
  const fs::path good = Shared("data/mbes/em710_g.all");
  SKIP_WITHOUT(good);
  TemporaryDir dir;
  const std::string empty = dir.Write("empty.kmall", "");
  const std::string head = dir.Write("head.kmall", Kmall().Installation().Profile(0.0).bytes());
  const std::string still =
      dir.Write("still.kmall", Kmall().Motion(2e5).Position(2e5).Position(2e5 + 1).bytes());
  const CommandResult replay =
      Replay(good.string() + " " + empty + " " + head + " " + still, dir.path() / "map");
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_THAT(replay.output, HasSubstr("not used: " + empty + ": empty\n"));
  EXPECT_THAT(replay.output, HasSubstr("left out: " + head + ": no sounding in it"));
  EXPECT_THAT(replay.output, HasSubstr("left out: " + still + ": no sounding in it"));
}

// GSF with compressed arrays.
TEST(SurveyLosses, WhatCannotBeReadIsTheReasonForAFileWithoutSoundings) {
  const fs::path file = Shared("data/mbes/gsf_v3_08.gsf");
  SKIP_WITHOUT(file);
  std::string other = TextOf(file);
  other.replace(other.find("GSF-v03"), 7, "GSF-v04");
  TemporaryDir dir;
  const CommandResult replay = Replay(dir.Write("a.gsf", other), dir.path() / "map");
  EXPECT_EQ(replay.exit_code, 65);
  EXPECT_THAT(replay.output, HasSubstr("no sounding in it; not read: "));
  EXPECT_THAT(replay.output, HasSubstr("gsf_version_unknown"));
}

}  // namespace
}  // namespace seastitch
