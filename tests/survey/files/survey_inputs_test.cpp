#include "tests/survey/files/plan_fixtures.hpp"

namespace seastitch {
namespace {

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
  EXPECT_EQ(played.samples.at("mbes_ping"), 5);
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

// The two swaths of a dual swath have the time and the number of their ping.
TEST(SurveyInputs, BothSwathsOfAPingAreMapped) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(0.0);
  for (int i = 0; i < 60; ++i)
    kmall.Motion(i).Position(i).Ping(i + 0.5, 1).Ping(i + 0.5, 1, 0.021f);
  const CommandResult result =
      Replay(dir.Write("a.kmall", kmall.bytes()) + " --soundings xyz", dir.path() / "map");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  std::ifstream soundings(dir.path() / "map/export/soundings.xyz");
  int lines = 0;
  for (std::string line; std::getline(soundings, line);) lines += line.empty() || line[0] != '#';
  EXPECT_EQ(lines, 2 * 60 * 50);
}

// A profile is used from its place in the file on, whenever it was cast; the first one from the
// start. The clock of a profiler may be hours fast.
TEST(SurveyInputs, AProfileIsUsedFromItsPlaceInTheFile) {
  TemporaryDir dir;
  Kmall kmall;
  kmall.Installation().Profile(8 * 3600.0, 1500.0);
  for (int i = 0; i < 60; ++i) {
    if (i == 40) kmall.Profile(-1800.0, 1490.0);
    kmall.Motion(i).Position(i).Ping(i + 0.5);
  }
  SurveyFiles survey(PlanSurvey({dir.Write("a.kmall", kmall.bytes())}));
  std::string order;
  int pings = 0;
  ReadAll(
      &survey,
      [&](const SoundVelocityProfile& profile) {
        order += " speed " + std::to_string(static_cast<int>(profile.speed_mps.at(0)));
        if (profile.speed_mps.at(0) == 1490.0) {
          EXPECT_NEAR(ToSeconds(profile.time - Kmall::At(0.0)), 40.0, 1.0);
        }
      },
      [&](const MbesPing&) {
        if (++pings == 1 || pings == 39 || pings == 42) order += " ping " + std::to_string(pings);
      });
  EXPECT_EQ(order, " speed 1500 ping 1 ping 39 speed 1490 ping 42");
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
  EXPECT_THAT(result.output, HasSubstr("pings: 300\n"));
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

TEST(SurveyInputs, AFileWithoutItsBeginningIsRead) {
  TemporaryDir dir;
  const std::string whole = Kmall().Survey().bytes();
  const std::string zeros(512, '\0');
  for (const std::string& bytes : {whole.substr(7), zeros + whole}) {
    const Played played({dir.Write("a.kmall", bytes)});
    EXPECT_EQ(played.Count("survey_pings"), 5);
    EXPECT_GT(played.Count("damaged_bytes"), 0);
  }
  for (const char* const name : {"em710_g.all", "gsf_v3_08.gsf", "r2sonic2026.xtf"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    std::ifstream in(file, std::ios::binary);
    std::string bytes(200'000, '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    EXPECT_NE(ReaderFor(dir.Write(name, bytes.substr(100))), nullptr) << name;
  }
  EXPECT_EQ(ReaderFor(dir.Write("b.kmall", std::string(100'000, 'x'))), nullptr);
}

TEST(SurveyInputs, AnSbetThatEndsWithinARecordIsRead) {
  TemporaryDir dir;
  const std::string sbet(3 * 136 - 50, '\0');
  EXPECT_NE(dynamic_cast<SbetFileReader*>(ReaderFor(dir.Write("a.sbet", sbet)).get()), nullptr);
  EXPECT_EQ(ReaderFor(dir.Write("a.out", sbet)), nullptr);
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
                      dir.Write("b.kmall",
                                Kmall()
                                    .Installation()
                                    .Replace("TRAI_TX1:X=0.000000", "TRAI_TX1:X=0.100000")
                                    .Motion(9.0)
                                    .bytes()),
                      dir.Write("c.kmall", Kmall().Survey(20.0).bytes())});
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_EQ(plan.warnings[0].code, WarningCode::kOtherInstallation);
  EXPECT_THAT(plan.warnings[0].text, StartsWith("b.kmall: "));
}

// Soundings of a GSF beside raw pings: counted and named.
TEST(SurveyInputs, PlacedSoundingsBesideRawPingsAreNamed) {
  const fs::path gsf = Shared("data/mbes/gsf_v3_08.gsf");
  SKIP_WITHOUT(gsf);
  TemporaryDir dir;
  const Played played({dir.Write("a.kmall", Kmall().Survey().bytes()), gsf});
  ASSERT_EQ(played.survey.plan().warnings.size(), 1u);
  EXPECT_EQ(played.survey.plan().warnings[0].code, WarningCode::kSoundingsNotUsed);
  EXPECT_EQ(played.Count("survey_pings_not_used"), 8);
}

// --- the vehicle ---------------------------------------------------------------------------------

TEST(SurveyVehicle, WithoutInstallationInTheFilesTheGivenOneIsKept) {
  SurveyPlan plan;
  plan.raw_pings = true;
  plan.position_source = "xtf_position";
  plan.vehicle.datum.latitude_rad = 0.5;
  MapperConfig config;
  config.vehicle.T_vehicle_mbes.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  config.vehicle.T_vehicle_imu.translation() = Eigen::Vector3d(4.0, 5.0, 6.0);
  const MapperConfig given = config;
  UseSurvey(plan, true, &config);
  EXPECT_EQ(config.vehicle.datum.latitude_rad, 0.5);
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

// Outer beams in 8.6 km of water are 17 km long and come back after 23 s.
TEST(SurveyVehicle, SoundingsOfTheDeepestWaterAreKept) {
  SurveyPlan plan;
  plan.max_range_m = 17'000.0;
  MapperConfig config;
  UseSurvey(plan, false, &config);
  EXPECT_EQ(config.filter.max_range_m, 25'500.0);
  plan.max_range_m = 25'000.0;
  UseSurvey(plan, false, &config);
  EXPECT_EQ(config.filter.max_range_m, 30'000.0);
  MbesBeam beam;
  beam.twtt_s = 23.0f;
  EXPECT_TRUE(IsPlausible(beam));
  beam.twtt_s = 41.0f;
  EXPECT_FALSE(IsPlausible(beam));
}

}  // namespace
}  // namespace seastitch
