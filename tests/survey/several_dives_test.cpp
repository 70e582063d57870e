// Several dives in one map, through the command line.

#include "tests/support/files.hpp"
#include "tests/survey/several_dives_fixture.hpp"

namespace seastitch {
namespace {

TEST_F(SeveralDives, BecomeOneMapAndOneElsewhereStandsApart) {
  // The same survey, 2 km further north.
  const fs::path config = Folder() / "elsewhere";
  fs::create_directories(config / "dive4");
  for (const char* const name : {"mapper_ins_tactical.yaml", "vehicle.yaml"})
    std::ofstream(config / name) << std::regex_replace(
        TextOf(ConfigFile(name)), std::regex("latitude_deg: 43.07"), "latitude_deg: 43.09");
  WriteSurveyFile({Folder() / "l.lcmlog",
                   InsAtDatum(config / "mapper_ins_tactical.yaml"),
                   config / "dive4" / "lines.kmall"});

  const CommandResult whole = Replay("whole.kmall");
  ASSERT_EQ(whole.exit_code, 0) << whole.output;
  const double in_one_m = Report()["truth"]["aligned_position_rms_m"]["after"];
  const CommandResult cut = Replay("dive1 dive2 dive3");
  ASSERT_EQ(cut.exit_code, 0) << cut.output;
  const double in_three_m = Report()["truth"]["aligned_position_rms_m"]["after"];
  RecordProperty("shape_in_one_m", std::to_string(in_one_m));
  RecordProperty("shape_in_three_m", std::to_string(in_three_m));
  std::printf("shape: %.3f m in one, %.3f m in three\n", in_one_m, in_three_m);
  // Three lines of 60 m without a fix. Whole surveys: docs/several-dives.md.
  EXPECT_LT(in_three_m, 1.5 * in_one_m);

  const CommandResult four = Replay("dive1/ dive2 dive3 elsewhere/dive4", "--soundings las");
  ASSERT_EQ(four.exit_code, 0) << four.output;
  const nlohmann::json dives = Report()["dives"];
  ASSERT_EQ(dives.size(), 4u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(dives[k]["name"], "dive" + std::to_string(k + 1));
    EXPECT_EQ(dives[k]["group"], 0) << four.output;
    EXPECT_GT(dives[k]["submaps"], 0);
  }
  EXPECT_GE(dives[1]["closures_with"]["dive1"], 1);
  EXPECT_EQ(dives[3]["group"], 3);
  EXPECT_THAT(four.output, HasSubstr("dive4 ("));
  EXPECT_THAT(four.output, HasSubstr("stands apart"));
  EXPECT_THAT(TextOf(out_.path() / "map/report.html"), HasSubstr("stands apart"));
  EXPECT_THAT(TextOf(out_.path() / "map/export/files.csv"), HasSubstr("4,lines.kmall"));
}

// Whole surveys of twenty minutes in three dives, each of which begins with a GPS fix of 1 m at the
// surface.
TEST_F(SeveralDives, EachWithAFixAtItsBeginAreAsGoodAsOne) {
  constexpr double kDiveS = 394.95;  // a third of the survey
  double in_one2 = 0.0, in_three2 = 0.0;
  for (const char* const seed : {"1", "2"}) {
    const TemporaryDir dir;
    std::string survey = std::regex_replace(
        TextOf(ConfigFile("bench/demo.yaml")), std::regex("class: mems"), "class: ins_tactical");
    survey = std::regex_replace(survey, std::regex("seed: 7"), std::string("seed: ") + seed);
    survey = survey.substr(0, survey.find("position_fixes:")) +
             "position_fixes: {interval_s: " + std::to_string(kDiveS) + ", sigma_m: 1.0}\n";
    const auto bench = RunCommand(
        Program("seastitch") + " bench --survey " + dir.Write("s.yaml", survey) + " --log " +
        (dir / "l.lcmlog").string() + " --survey-file " + (dir / "whole.kmall").string());
    ASSERT_EQ(bench.exit_code, 0) << bench.output;
    testing::CutKmall(dir / "whole.kmall", 3, dir.path(), "dive");
    dir.Write("mapper.yaml",
              "vehicle: " + ConfigFile("vehicle.yaml") +
                  "\ngiven_navigation: {position_sigma_m: 1, follow_velocity: true}\n");
    const auto shape_m = [&](const std::string& inputs) -> double {
      const CommandResult result = RunCommand(
          "cd " + dir.path().string() + " && " + Program("seastitch") + " replay --quiet " +
          inputs + " --config mapper.yaml --truth l.lcmlog.truth.csv --out " +
          (out_.path() / "map").string());
      EXPECT_EQ(result.exit_code, 0) << result.output;
      return Report()["truth"]["aligned_position_rms_m"]["after"];
    };
    const double in_one_m = shape_m("whole.kmall");
    const double in_three_m = shape_m("dive1 dive2 dive3");
    std::printf("seed %s: shape %.3f m in one, %.3f m in three\n", seed, in_one_m, in_three_m);
    for (const nlohmann::json& dive : Report()["dives"]) EXPECT_EQ(dive["group"], 0) << dive;
    in_one2 += in_one_m * in_one_m;
    in_three2 += in_three_m * in_three_m;
  }
  EXPECT_LT(std::sqrt(in_three2), 1.2 * std::sqrt(in_one2));
}

// Positions of an INS wait for what follows them, in which they may turn out to be jumps.
TEST_F(SeveralDives, TheTrackReachesToTheLastPing) {
  const CommandResult result = Replay("whole.kmall");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  Time last_ping;
  for (SurveyStream stream(Folder() / "whole.kmall", SurveyFiles::kReorderS); stream.next();) {
    const SurveyRecord record = stream.Take();
    if (const auto* const ping = std::get_if<MbesPing>(&record)) last_ping = ping->time;
  }
  std::ifstream track(out_.path() / "map" / "track.csv");
  std::string line, last;
  while (std::getline(track, line)) last = line;
  EXPECT_GE(std::stoll(last), ToUtime(last_ping) - 200'000) << "states are 0.1 s apart";
}

TEST_F(SeveralDives, TheSameInputsGiveTheSameMap) {
  ASSERT_EQ(Replay("dive1 dive2").exit_code, 0);
  const std::string first = TextOf(out_.path() / "map/elevation.tif");
  ASSERT_EQ(Replay("dive1 dive2").exit_code, 0);
  EXPECT_TRUE(first == TextOf(out_.path() / "map/elevation.tif"));
  // Publish() knows every product by its name.
  std::set<std::string> known(product_files::kFolders.begin(), product_files::kFolders.end());
  known.insert(product_files::kAll.begin(), product_files::kAll.end());
  known.insert("report.json");
  for (const auto& entry : fs::directory_iterator(out_.path() / "map"))
    EXPECT_TRUE(known.contains(entry.path().filename().string())) << entry.path();
}

// One line about the file that all dives share, and one about the map.
TEST_F(SeveralDives, AnErrorOrAResultIsPrintedOnce) {
  std::ofstream(Folder() / "wrong.yaml") << "no_such_key: 1\n";
  const CommandResult wrong = Replay("dive1 dive2", "--config wrong.yaml");
  EXPECT_EQ(wrong.exit_code, 78) << wrong.output;
  EXPECT_EQ(wrong.output.find('\n'), wrong.output.size() - 1) << wrong.output;

  const CommandResult loud = RunCommand("cd " + Folder().string() + " && " + Program("seastitch") +
                                        " replay dive1 --out " + (out_.path() / "map").string());
  ASSERT_EQ(loud.exit_code, 0) << loud.output;
  const std::string statement = Report()["statement"];
  const std::size_t first = loud.output.find(statement);
  ASSERT_NE(first, std::string::npos) << loud.output;
  EXPECT_EQ(loud.output.find(statement, first + 1), std::string::npos) << loud.output;
}

// Not damage of the computer or the command line: 65, so that a batch of surveys goes on.
TEST_F(SeveralDives, ALogWithoutEventsIsNoData) {
  std::ofstream(Folder() / "empty.lcmlog").close();
  std::ofstream(Folder() / "foreign.lcmlog") << "not a log, though its name says so";
  for (const char* const name : {"empty.lcmlog", "foreign.lcmlog"}) {
    const CommandResult result = Replay(name);
    EXPECT_EQ(result.exit_code, 65) << result.output;
    EXPECT_THAT(result.output, HasSubstr("holds no LCM event\n"));
  }
  fs::create_directories(Folder() / "nothing");
  EXPECT_EQ(Replay("nothing").exit_code, 65);
}

TEST_F(SeveralDives, TheDatumIsThatOfTheFirstUnlessOneIsGiven) {
  ASSERT_EQ(Replay("dive2 dive1").exit_code, 0);
  const nlohmann::json own = Report();
  ASSERT_EQ(Replay("dive2 dive1", "--datum 43.1,-70.7").exit_code, 0);
  EXPECT_THAT(TextOf(out_.path() / "map/report.html"), HasSubstr("43.1000000&deg;"));
  EXPECT_EQ(Report()["submaps"], own["submaps"]);
  const CommandResult wrong = Replay("dive2 dive1", "--datum 430.1,-70.7");
  EXPECT_EQ(wrong.exit_code, 64) << wrong.output;
}

TEST_F(SeveralDives, OneThatIsDamagedIsLeftOutAndNamed) {
  for (const char* const name : {"broken", "empty", "notes", "torn"})
    fs::create_directories(Folder() / name);
  std::ofstream(Folder() / "broken" / "lines.kmall", std::ios::binary)
      << TextOf(Folder() / "dive2" / "lines.kmall").substr(0, 5'000);
  std::ofstream(Folder() / "notes" / "weather.txt") << "calm";
  std::ofstream(Folder() / "torn" / "dive.json") << "{}";  // a dive's folder without a log
  const CommandResult result = Replay("broken dive1 empty notes torn dive3");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const nlohmann::json report = Report();
  ASSERT_EQ(report["dives"].size(), 2u);
  EXPECT_EQ(report["dives"][0]["name"], "dive1");
  EXPECT_EQ(report["dives"][1]["name"], "dive3");
  std::map<std::string, std::string> reasons;
  for (const nlohmann::json& dive : report["dives_not_read"])
    reasons[dive["name"]] = dive["reason"];
  ASSERT_EQ(reasons.size(), 4u) << result.output;
  EXPECT_FALSE(reasons["broken"].empty());
  EXPECT_THAT(reasons["empty"], HasSubstr("it is empty"));
  EXPECT_THAT(reasons["notes"], HasSubstr("it holds weather.txt"));
  EXPECT_THAT(reasons["torn"], HasSubstr("holds no log"));
  for (const auto& [name, reason] : reasons)
    EXPECT_THAT(result.output, HasSubstr(name + ": left out: " + reason + "\n"));
  EXPECT_THAT(TextOf(out_.path() / "map/report.html"),
              HasSubstr("notes was not read, or not to its end: "));

  const CommandResult none = Replay("broken notes");
  EXPECT_EQ(none.exit_code, Replay("broken").exit_code) << none.output;
  EXPECT_EQ(none.exit_code, 65) << none.output;
}

// Given in another order, so that the numbers of the dives are not in order of time.
TEST_F(SeveralDives, EachHasItsOwnNavigationAndTimeOffsetInTheReport) {
  ASSERT_EQ(Replay("dive3 dive1").exit_code, 0);
  const nlohmann::json report = Report();
  ASSERT_EQ(report["dives"].size(), 2u);
  for (const nlohmann::json& dive : report["dives"]) {
    SCOPED_TRACE(dive["name"]);
    EXPECT_GT(dive["mapper_counters"]["beams_read"], 1000);
    EXPECT_GT(dive["navigation"]["stated_at_end"]["sigma_north_m"], 0.0);
    EXPECT_EQ(dive["sonar_time_offset"]["configured_s"], 0.0);
  }
  std::istringstream navigation(TextOf(out_.path() / "map/export/navigation.csv"));
  std::string before, line;
  std::getline(navigation, line);  // names of the columns
  while (std::getline(navigation, line)) {
    const std::string time = line.substr(0, line.find(','));
    ASSERT_LT(before, time);
    before = time;
  }
  EXPECT_FALSE(before.empty());

  // A third of the survey has too few pings for the offset, the whole has enough.
  fs::create_directories(Folder() / "long");
  fs::copy_file(Folder() / "whole.kmall",
                Folder() / "long" / "lines.kmall",
                fs::copy_options::overwrite_existing);
  ASSERT_EQ(Replay("dive1 long").exit_code, 0);
  const nlohmann::json offset = Report()["dives"][1]["sonar_time_offset"];
  ASSERT_TRUE(offset["by_roll"].is_object()) << offset;
  EXPECT_GT(offset["by_roll"]["pings"], 1000);
  EXPECT_THAT(TextOf(out_.path() / "map/report.html"),
              HasSubstr("long: Time offset of the sonar's stamps, by roll"));
}

}  // namespace
}  // namespace seastitch
