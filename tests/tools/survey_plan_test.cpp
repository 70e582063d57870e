// Which sensors, files and installation a replay of survey files uses, and what it does with files
// that it cannot use.
#include "tools/survey_plan.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>

#include "codecs/s7k.hpp"
#include "codecs/s7k_writer.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/given_navigation.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/runtime/temporary_dir.hpp"
#include "tests/tools/small_kmall.hpp"
#include "tools/dive_inputs.hpp"
#include "tools/maker_soundings.hpp"
#include "tools/message_types.hpp"
#include "tools/survey_config.hpp"
#include "tools/survey_files.hpp"
#include "tools/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

// --- depth and geometry of real files ------------------------------------------------------------

// Heave of `.all` is that of the transmitter, which is 12 m before the reference point of em710_g.
TEST(SurveyGeometry, TransducerIsAtTheDepthThatTheSonarStates) {
  for (const char* const name : {"em710_g.all", "em2040_ac.all", "em2040c_ay.all"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    SurveyFiles survey(MakeSurveyPlan({file}));
    const VehicleGeometry& vehicle = survey.plan().vehicle;
    GivenNavigation navigation({}, {}, vehicle);
    std::map<Time, double> stated_m;
    survey.OnPlacedPing(
        [&](const PlacedPing& ping) { stated_m[ping.time] = *ping.origin_depth_m; });
    Bus bus("memq://");
    bus.Subscribe<navigation_t>(
        channels::kIns, 0, [&](const navigation_t& message) { navigation.Add(*FromLcm(message)); });
    bus.Subscribe<depth_t>(
        channels::kDepth, 0, [&](const depth_t& message) { navigation.Add(*FromLcm(message)); });
    while (survey.PublishNext(&bus)) bus.HandleAll();
    navigation.Finish();
    int compared = 0;
    double sum_m = 0.0, most_m = 0.0;
    for (const auto& [time, depth_m] : stated_m) {
      const auto state = navigation.StateAt(time);
      if (!state) continue;
      const double off_m = (state->T_map_vehicle * vehicle.T_mbes_tx.translation()).z() - depth_m;
      sum_m += off_m;
      most_m = std::max(most_m, std::abs(off_m));
      ++compared;
    }
    ASSERT_GT(compared, 4) << name;
    std::printf(
        "%s: %d pings, mean %.4f m, largest %.4f m\n", name, compared, sum_m / compared, most_m);
    EXPECT_LT(most_m, 0.01) << name;
  }
}

// Raw times and angles through the replay's own navigation and geometry. em710_g: the ship moves
// sideways by 0.2 m/s between sending and receiving, which its sonar leaves out (y). em2040_OS01:
// the three parts of the transmitter are taken to be at its centre (y, z).
TEST(SurveyGeometry, ReplayedSoundingsAreWhereTheSonarPutsThem) {
  struct Case {
    const char* name;
    int pings, beams;
    Eigen::Vector3d rms_percent;
  };
  for (const Case& c : {Case{"em710_g.all", 7, 2800, {0.0026, 0.0276, 0.0086}},
                        Case{"em2040_OS01.kmall", 4, 1919, {0.0098, 0.2256, 0.1670}},
                        Case{"em2040_eg.kmall", 23, 10536, {0.0116, 0.0267, 0.0295}}}) {
    const fs::path file = Shared(std::string("data/mbes/") + c.name);
    SKIP_WITHOUT(file);
    const SoundingComparison result = CompareWithMaker(PlanSurvey({file}), 1000);
    std::printf("%s: %d pings, %d beams, RMS %% of depth %.4f %.4f %.4f\n",
                c.name,
                result.pings,
                result.beams,
                result.rms_percent.x(),
                result.rms_percent.y(),
                result.rms_percent.z());
    EXPECT_EQ(result.pings, c.pings) << c.name;
    EXPECT_EQ(result.beams, c.beams) << c.name;
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LT(result.rms_percent(axis), 1.2 * c.rms_percent(axis)) << c.name << " axis " << axis;
  }
}

// One real file was traced with the profile alone, the others from the sound speed at the
// transducer.
TEST(SurveyGeometry, SoundSpeedIsTheOneThatTheSonarTracedWith) {
  for (const auto& [name, alone] : {std::pair{"em2040_eg.kmall", true},
                                    std::pair{"em2040_OS01.kmall", false},
                                    std::pair{"em710_g.all", false}}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    const SurveyPlan plan = PlanSurvey({file});
    EXPECT_EQ(plan.profile_alone, alone) << name;
    EXPECT_THAT(plan.Text(),
                HasSubstr(alone ? "sound speed: the profile alone" : "at the transducer"));
  }
}

// --- sensors -------------------------------------------------------------------------------------

TEST(SurveySensors, ActivePositionSystemIsUsedByItsNumber) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey();  // POSI_1 is active; its records have system 0
  for (int i = 0; i < 50; ++i) kmall.Position(0.1 * i, 1);
  EXPECT_EQ(MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())}).position_source, "#SPO0");
}

TEST(SurveySensors, InvalidPositionsAreNotUsed) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 5; ++i) kmall.Motion(i).Position(i, 0, i != 2).Ping(i + 0.5);
  const auto played = Played({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(played.messages.at(channels::kIns), 5 * 20 + 4);
}

TEST(SurveySensors, ActiveMotionSensorIsUsedThoughAnotherIsFaster) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Survey();  // ATTI_1 is active; its records have system 0
  for (int i = 0; i < 5; ++i) kmall.Motion(i, 1, 100);
  EXPECT_EQ(MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())}).attitude_source, "#SKM0");
}

// Roll and pitch at 20 Hz, and a heading once per second but for a gap of ten.
TEST(SurveySensors, HeadingIsNotInterpolatedOverAGap) {
  TemporaryDir dir;
  std::string bytes;
  const auto add = [&bytes](const std::vector<std::uint8_t>& d) {
    bytes.append(d.begin(), d.end());
  };
  SonarInstallation installation;
  installation.time = Kmall::At(0.0);
  installation.transmitters.resize(1);
  installation.receivers.resize(1);
  add(EncodeS7k7030(installation));
  const auto record = [](std::uint32_t type, double t_s, const std::vector<float>& values) {
    ByteWriter data;
    for (const float value : values) data.Le(value);
    return EncodeS7kRecord(type, S7kPingId{}, Kmall::At(t_s), data.bytes());
  };
  for (int i = 0; i < 400; ++i) {
    const double t_s = 0.05 * i;
    add(record(1012, t_s, {0.01f, 0.0f, 0.0f}));
    if (i % 20 == 0 && (t_s < 4.5 || t_s > 13.5)) add(record(1013, t_s, {1.0f}));
  }
  const auto played = Played({dir.Write("a.s7k", bytes)});
  EXPECT_GT(played.messages.at(channels::kIns), 180);
  EXPECT_GE(played.Count("survey_attitude_without_heading"), 180);
  EXPECT_LE(played.Count("survey_attitude_without_heading"), 220);
}

// --- files ---------------------------------------------------------------------------------------

TEST(SurveyInputs, LargeFirstDatagramsDoNotHideThePositions) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0).Ping(0.5);
  for (int i = 0; i < 20; ++i) kmall.Foreign("#MWC", 1'000'000);
  for (int i = 0; i < 3; ++i) kmall.Motion(i).Position(i);
  const SurveyPlan plan = MakeSurveyPlan({dir.Write("a.kmall", kmall.bytes())});
  EXPECT_EQ(plan.position_source, "#SPO0");
  EXPECT_FALSE(plan.Problem());
}

TEST(SurveyInputs, DayIsThatOfTheFirstPingWhateverTheDayOfTheCast) {
  TemporaryDir dir;
  constexpr double kDayS = 86'400.0;
  const auto survey = [](double from_s, double cast_s) {
    Kmall kmall;
    kmall.Profile(cast_s).Motion(from_s).Position(from_s).Ping(from_s + 0.5);
    return kmall.bytes();
  };
  // Two files of one day with casts of two days, and one of the next day with the first cast.
  const std::vector<DiveInput> dives =
      DivesAmong({dir.Write("a.kmall", survey(0.0, -2 * kDayS)),
                  dir.Write("b.kmall", survey(3600.0, -kDayS)),
                  dir.Write("c.kmall", survey(kDayS, -2 * kDayS))});
  ASSERT_EQ(dives.size(), 2u);
  EXPECT_EQ(dives[0].name, "2026-05-02");
  EXPECT_EQ(dives[0].files.size(), 2u);
  EXPECT_EQ(dives[1].name, "2026-05-03");
}

constexpr char kFnv[] =
    "2026 05 02 12 00 00.5 1777723200.5 5.0 57.0 90.0 2.0 0 0 0 0 5 57 5 57\n"
    "2026 05 02 12 00 04.5 1777723204.5 5.0 57.0 90.0 2.0 0 0 0 0 5 57 5 57\n";

TEST(SurveyInputs, NavigationBesideAFolderIsThatOfTheFolder) {
  TemporaryDir dir;
  fs::create_directories(dir.path() / "DAY");
  dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const fs::path beside = dir.Write("adjusted.fnv", kFnv);
  const std::vector<DiveInput> dives = DivesAmong({dir.path() / "DAY", beside});
  ASSERT_EQ(dives.size(), 1u);
  EXPECT_THAT(dives[0].files, ElementsAre(dir.path() / "DAY" / "a.kmall", beside));
  EXPECT_EQ(MakeSurveyPlan(dives[0].files).position_source, "fnv");
  fs::create_directories(dir.path() / "submaps");
  EXPECT_THAT(
      [&] {
        DivesAmong({dir.path() / "submaps", beside});
      },
      ThrowsMessage<UsageError>(HasSubstr("adjusted.fnv: navigation beside survey files")));
}

TEST(SurveyInputs, AFileGivenTwiceIsRefused) {
  TemporaryDir dir;
  fs::create_directories(dir.path() / "DAY");
  const fs::path line = dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const CommandResult result =
      Replay((dir.path() / "DAY").string() + " " + line.string(), dir.path() / "map");
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_EQ(result.output, "seastitch: replay: " + line.string() + ": given twice\n");
}

TEST(SurveyInputs, PingsOfACopyAreUsedOnce) {
  TemporaryDir dir;
  const std::string bytes = Kmall().Survey().bytes();
  const Played played({dir.Write("a.kmall", bytes), dir.Write("copy.kmall", bytes)});
  EXPECT_EQ(played.messages.at(channels::kMbesPing), 5);
  EXPECT_EQ(played.Count("survey_pings_repeated"), 5);
}

// Two pings of one time are no copies if their numbers differ.
TEST(SurveyInputs, PingsOfOneTimeAreKept) {
  TemporaryDir dir;
  const std::string bytes = Kmall().Survey().Ping(2.0, 7).Ping(2.0, 8).bytes();
  const Played played({dir.Write("a.kmall", bytes)});
  EXPECT_EQ(played.Count("survey_pings"), 7);
  EXPECT_EQ(played.Count("survey_pings_repeated"), 0);
}

TEST(SurveyInputs, MoreFilesThanAProcessMayOpen) {
  TemporaryDir dir;
  std::string files;
  for (int i = 0; i < 60; ++i)
    files += " " + dir.Write("l" + std::to_string(i) + ".kmall", Kmall().Survey(6.0 * i).bytes());
  const CommandResult result =
      RunCommand("ulimit -n 40; " + Program("seastitch") + " import --quiet" + files + " --log " +
                 (dir.path() / "a.lcmlog").string());
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("survey_pings: 300\n"));
}

TEST(SurveyInputs, NavigationWithoutARecordIsRefused) {
  TemporaryDir dir;
  const std::string kmall = dir.Write("a.kmall", Kmall().Survey().bytes());
  const std::string empty = dir.Write("b.fnv", "## no line of numbers in this file at all\n");
  const CommandResult result = Replay(kmall + " " + empty, dir.path() / "map");
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_EQ(result.output,
            "seastitch: " + empty + ": no line or record of navigation that can be read\n");
}

// Byte 4 of an SBET can be '#'.
TEST(SurveyInputs, AnSbetIsNoKmallWhateverItsBytes) {
  TemporaryDir dir;
  std::string sbet(3 * 136, '\0');
  for (std::size_t i = 0; i < 3; ++i) {
    const double second = 302'400.0 + static_cast<double>(i);
    std::memcpy(sbet.data() + 136 * i, &second, sizeof second);
  }
  sbet[4] = '#';
  EXPECT_NE(dynamic_cast<SbetFileReader*>(ReaderFor(dir.Write("a.sbet", sbet)).get()), nullptr);
  EXPECT_EQ(ReaderFor(dir.Write("a.dat", sbet)), nullptr);
}

TEST(SurveyInputs, AFileOfAnotherKindIsNamedAndIsNoData) {
  TemporaryDir dir;
  for (const auto& [name, bytes] :
       {std::pair{"empty.all", std::string()}, std::pair{"foreign.all", std::string(500, 'x')}}) {
    const std::string file = dir.Write(name, bytes);
    const CommandResult result = Replay(file, dir.path() / "map");
    EXPECT_EQ(result.exit_code, 65) << result.output;
    EXPECT_EQ(result.output,
              "seastitch: " + file +
                  (bytes.empty() ? ": empty\n"
                                 : ": neither a log nor a survey file of a known "
                                   "format\n"));
  }
  fs::create_directories(dir.path() / "DAY");
  dir.Write("DAY/a.kmall", Kmall().Survey().bytes());
  const std::string lost = dir.Write("DAY/b.all", "");
  EXPECT_THAT(Replay((dir.path() / "DAY").string(), dir.path() / "map").output,
              HasSubstr("not used: " + lost + ": empty\n"));
}

TEST(SurveyInputs, CandumpLogsAreNotImportedTogetherWithSurveyFilesOfNavigation) {
  const fs::path file = Shared("data/mbes/em710_g.all");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const CommandResult result = RunCommand(Program("seastitch") + " import " + file.string() + " " +
                                          dir.Write("b.candump", "(1.0) can0 123#00\n") +
                                          " --log " + (dir.path() / "l").string());
  EXPECT_EQ(result.exit_code, 64);
  EXPECT_THAT(result.output, HasSubstr("not imported together with candump logs"));
}

TEST(SurveyInputs, AFileWithoutSoundingsSaysWhatItHolds) {
  TemporaryDir dir;
  std::string xtf(1024, '\0');
  xtf[0] = 123;
  const auto packet = [](char type) {
    std::string bytes(256, '\0');
    bytes[0] = '\xCE';
    bytes[1] = '\xFA';
    bytes[2] = type;
    bytes[11] = 1;  // 256 bytes
    return bytes;
  };
  for (int i = 0; i < 9; ++i) xtf += packet(0);
  xtf += packet(1);
  const std::string file = dir.Write("side.xtf", xtf);
  const CommandResult result = Replay(file, dir.path() / "map");
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_EQ(result.output,
            "seastitch: " + file + ": no sounding in it; not read: 9 xtf_sonar, 1 xtf_notes\n");
}

TEST(SurveyInputs, AnotherInstallationIsNamed) {
  TemporaryDir dir;
  const SurveyPlan plan =
      MakeSurveyPlan({dir.Write("a.kmall", Kmall().Survey().bytes()),
                      dir.Write("b.kmall", Kmall().Installation(0.5).Motion(9.0).bytes()),
                      dir.Write("c.kmall", Kmall().Survey(20.0).bytes())});
  EXPECT_THAT(plan.Text(), HasSubstr("not used: another installation in b.kmall\n"));
}

// Soundings of a GSF beside raw pings: counted and named.
TEST(SurveyInputs, PlacedSoundingsBesideRawPingsAreNamed) {
  const fs::path gsf = Shared("data/mbes/gsf_v3_08.gsf");
  SKIP_WITHOUT(gsf);
  TemporaryDir dir;
  const Played played({dir.Write("a.kmall", Kmall().Survey().bytes()), gsf});
  EXPECT_THAT(played.survey.plan().Text(), HasSubstr("not used: gsf_v3_08.gsf: soundings"));
  EXPECT_EQ(played.Count("survey_pings_not_used"), 8);
}

// --- the vehicle ---------------------------------------------------------------------------------

TEST(SurveyVehicle, WithoutInstallationInTheFilesTheGivenOneIsKept) {
  SurveyPlan plan;
  plan.raw_pings = true;
  plan.position_source = "xtf_position";
  plan.vehicle.datum_latitude_rad = 0.5;
  MapperConfig config;
  config.vehicle.T_vehicle_mbes.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  config.vehicle.T_vehicle_imu.translation() = Eigen::Vector3d(4.0, 5.0, 6.0);
  const MapperConfig given = config;
  UseSurvey(plan, true, &config);
  EXPECT_EQ(config.vehicle.datum_latitude_rad, 0.5);
  EXPECT_TRUE(config.vehicle.T_vehicle_mbes.isApprox(given.vehicle.T_vehicle_mbes));
  EXPECT_TRUE(config.vehicle.T_vehicle_imu.isApprox(given.vehicle.T_vehicle_imu));
  plan.position_source = "sbet";  // of the reference point
  UseSurvey(plan, true, &config);
  EXPECT_TRUE(config.vehicle.T_vehicle_imu.translation().isZero());
  for (const bool has_installation : {true, false}) {
    config = given;
    plan.has_installation = has_installation;
    UseSurvey(plan, has_installation, &config);
    EXPECT_TRUE(config.vehicle.T_vehicle_mbes.translation().isZero());
  }
}

}  // namespace
}  // namespace seastitch
