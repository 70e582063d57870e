#include "tests/support/files.hpp"
#include "tests/survey/several_dives_fixture.hpp"

namespace seastitch {
namespace {

// A `.all` file with a datagram h (height of the water line) after each P.
std::string WithHeightDatagrams(const std::string& all, double height_m) {
  constexpr std::size_t kLengthBytes = 4, kHeaderBytes = 16;
  std::string out;
  for (std::size_t at = 0; at + kLengthBytes + kHeaderBytes < all.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, all.data() + at, kLengthBytes);
    const std::string datagram = all.substr(at + kLengthBytes, length);
    out += all.substr(at, kLengthBytes + length);
    at += kLengthBytes + length;
    if (datagram[1] != 'P') continue;
    std::string h = datagram.substr(0, kHeaderBytes);
    h[1] = 'h';
    const auto height_cm = static_cast<std::int32_t>(std::lround(100.0 * height_m));
    h.append(reinterpret_cast<const char*>(&height_cm), sizeof height_cm);
    h += '\0';  // of the water line
    std::uint16_t sum = 0;
    for (std::size_t i = 1; i < h.size(); ++i)
      sum = static_cast<std::uint16_t>(sum + static_cast<std::uint8_t>(h[i]));
    h += '\3';
    h.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    length = static_cast<std::uint32_t>(h.size());
    out.append(reinterpret_cast<const char*>(&length), kLengthBytes);
    out += h;
  }
  return out;
}

// Maps made from survey files of each format agree, except for the formats' rounding and for what
// .s7k does not contain (delays of sectors).
TEST_F(SeveralDives, EveryFormatThatIsWrittenGivesTheMap) {
  ASSERT_EQ(Replay("whole.kmall").exit_code, 0);
  const double kmall_m = Report()["truth"]["aligned_position_rms_m"]["after"];
  const int submaps = Report()["submaps"];
  for (const char* const name : {"whole.all", "whole.s7k"}) {
    WriteSurveyFile({Folder() / "l.lcmlog",
                     InsAtDatum(ConfigFile("mapper_ins_tactical.yaml")),
                     Folder() / name});
    const CommandResult result = Replay(name);
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const double shape_m = Report()["truth"]["aligned_position_rms_m"]["after"];
    std::printf("shape: %.3f m from .kmall, %.3f m from %s\n", kmall_m, shape_m, name);
    EXPECT_LT(shape_m, 1.5 * kmall_m) << name;
    EXPECT_EQ(Report()["submaps"], submaps) << name;
  }
}

// An INS that uses a fix now and then, and jumps. A .s7k with 1003 alone has no velocities.
TEST_F(SeveralDives, JumpsOfTheInsAreTakenOutWhateverTheFormat) {
  const TemporaryDir dir;
  const std::string survey =
      std::regex_replace(ShortSurveyUnderWater(), std::regex("mems"), "ins_tactical");
  const auto bench = RunCommand(
      Program("seastitch") + " bench --survey " +
      dir.Write("s.yaml", survey + "position_fixes: {interval_s: 60.0, sigma_m: 3.0}\n") +
      " --log " + (dir.path() / "l.lcmlog").string());
  ASSERT_EQ(bench.exit_code, 0) << bench.output;
  for (const char* const name : {"jumps.kmall", "jumps.all", "jumps.s7k", "of_1003.s7k"}) {
    SurveyWriterOptions options{dir.path() / "l.lcmlog",
                                InsAtDatum(ConfigFile("mapper_ins_tactical.yaml")),
                                dir.path() / name};
    options.velocity_with_position = std::string(name) != "of_1003.s7k";
    const SurveyWriterResult written = WriteSurveyFile(options);
    ASSERT_GE(written.fixes, 2);
    const CommandResult result = Replay((dir.path() / name).string());
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const nlohmann::json report = Report();
    EXPECT_EQ(report["mapper_counters"]["nav_ins_position_jumps"], written.fixes) << name;
    const double shape_m = report["truth"]["aligned_position_rms_m"]["after"];
    const double given_m = report["truth"]["aligned_position_rms_m"]["before"];
    std::printf("%s: shape %.3f -> %.3f m\n", name, given_m, shape_m);
    EXPECT_LT(given_m, 0.3) << name << ": a jump is left in the track";
    EXPECT_LT(shape_m, 0.1) << name;
  }
}

// The same survey of 20 minutes through sensors and our dead reckoning, and from the file of an INS
// with the same sensors (class mems) that uses a fix of 2 m every four minutes. The INS finds in
// its first turn that its heading is wrong, and its position moves by 1 m in a second. Our own
// navigation corrects its past, which no file of an INS can: 0.17 m without that.
TEST_F(SeveralDives, AFileOfAnInsIsNearlyAsGoodAsItsSensors) {
  const TemporaryDir dir;
  std::string survey =
      std::regex_replace(TextOf(ConfigFile("bench/demo.yaml")), std::regex("seed: 7"), "seed: 5");
  survey = survey.substr(0, survey.find("position_fixes:")) +
           "position_fixes: {interval_s: 240.0, sigma_m: 2.0}\n";
  const auto bench = RunCommand(
      Program("seastitch") + " bench --survey " + dir.Write("s.yaml", survey) + " --log " +
      (dir / "l.lcmlog").string() + " --survey-file " + (dir / "ins.s7k").string());
  ASSERT_EQ(bench.exit_code, 0) << bench.output;
  // The data sheet: the errors of class mems.
  dir.Write("mapper.yaml",
            "vehicle: " + ConfigFile("vehicle.yaml") +
                "\ngiven_navigation:\n  {heading_sigma_deg: 0.6, heading_wander_deg: 0.78,"
                " heading_wander_tau_s: 300, distance_error_ratio: 0.005,"
                " random_walk_m_per_sqrt_m: 0.01, position_sigma_m: 2, follow_velocity: true}\n");
  const auto shape_m = [&](const std::string& input) -> double {
    const CommandResult result = RunCommand(
        "cd " + dir.path().string() + " && " + Program("seastitch") + " replay --quiet " + input +
        " --truth l.lcmlog.truth.csv --out " + (out_.path() / "map").string());
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return Report()["truth"]["aligned_position_rms_m"]["after"];
  };
  const double sensors_m = shape_m("l.lcmlog");
  const double file_m = shape_m("ins.s7k --config mapper.yaml");
  std::printf("shape: %.3f m through sensors, %.3f m from the file\n", sensors_m, file_m);
  EXPECT_LT(file_m, 0.13);
  EXPECT_LT(sensors_m, 0.1);
}

// Each dive has its fixes and its frames for them, which are no submaps to a person.
TEST_F(SeveralDives, EachKeepsItsFixesAtTheSurface) {
  const TemporaryDir dir;
  const auto replay = [&](const std::string& inputs) {
    const CommandResult result =
        RunCommand("cd " + dir.path().string() + " && " + Program("seastitch") +
                   " replay --quiet " + inputs + " --out " + (out_.path() / "map").string());
    EXPECT_EQ(result.exit_code, 0) << result.output;
    std::smatch fixes;
    const std::string statement = Report()["statement"];
    EXPECT_TRUE(std::regex_search(statement, fixes, std::regex("up to (\\d+) position fixes")))
        << statement;
    return std::pair(Report()["submaps"].get<int>(), std::stoi(fixes[1].str()));
  };
  std::pair<int, int> sum{0, 0};
  for (const std::string seed : {"11", "12"}) {
    fs::create_directory(dir / seed);
    const std::string survey = std::regex_replace(
        TextOf(ConfigFile("bench/short.yaml")), std::regex("seed: 11"), "seed: " + seed);
    const auto bench =
        RunCommand(Program("seastitch") + " bench --survey " + dir.Write("s.yaml", survey) +
                   " --log " + (dir / seed / "l.lcmlog").string());
    ASSERT_EQ(bench.exit_code, 0) << bench.output;
    const auto [submaps, fixes] = replay(seed);
    EXPECT_GE(fixes, 4);
    sum.first += submaps;
    sum.second += fixes;
  }
  EXPECT_EQ(replay("11 12"), sum);
}

// The exported corrected navigation, used as an SBET beside the same pings.
TEST_F(SeveralDives, ASbetBesideTheFilesIsTheirNavigation) {
  ASSERT_EQ(Replay("whole.kmall").exit_code, 0);
  const double corrected_m = Report()["truth"]["aligned_position_rms_m"]["after"];
  const double drifted_m = Report()["truth"]["aligned_position_rms_m"]["before"];
  ASSERT_GT(drifted_m, 1.5 * corrected_m);
  fs::copy_file(out_.path() / "map/export/navigation.sbet",
                Folder() / "processed.sbet",
                fs::copy_options::overwrite_existing);
  const CommandResult result = Replay("whole.kmall processed.sbet");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const double before_m = Report()["truth"]["aligned_position_rms_m"]["before"];
  EXPECT_NEAR(before_m, corrected_m, 0.005);
  // The same with times in UTC instead of GPS time.
  std::string utc = TextOf(Folder() / "processed.sbet");
  for (std::size_t at = 0; at < utc.size(); at += 136) {
    double second = 0.0;
    std::memcpy(&second, utc.data() + at, sizeof second);
    second -= 18.0;
    std::memcpy(utc.data() + at, &second, sizeof second);
  }
  std::ofstream(Folder() / "utc.sbet", std::ios::binary) << utc;
  const CommandResult in_utc = Replay("whole.kmall utc.sbet");
  ASSERT_EQ(in_utc.exit_code, 0) << in_utc.output;
  EXPECT_NEAR(Report()["truth"]["aligned_position_rms_m"]["before"], before_m, 1e-6);
  const CommandResult alone = Replay("processed.sbet");
  EXPECT_NE(alone.exit_code, 0);
}

// Adjusted positions of another program; attitude and heave are those of the sonar's files.
TEST_F(SeveralDives, TextBesideTheFilesIsTheirPosition) {
  ASSERT_EQ(Replay("whole.kmall").exit_code, 0);
  const double corrected_m = Report()["truth"]["aligned_position_rms_m"]["after"];
  const double drifted_m = Report()["truth"]["aligned_position_rms_m"]["before"];
  ASSERT_GT(drifted_m, 1.5 * corrected_m);
  const auto overwrite = fs::copy_options::overwrite_existing;
  const fs::path exported = out_.path() / "map/export";
  fs::copy_file(exported / "navigation.na0", Folder() / "adjusted.na0", overwrite);
  fs::copy_file(exported / "navigation.csv", Folder() / "adjusted.csv", overwrite);
  const auto before_m = [this]() -> double {
    return Report()["truth"]["aligned_position_rms_m"]["before"];
  };
  const CommandResult known = Replay("whole.kmall adjusted.csv");
  ASSERT_EQ(known.exit_code, 0) << known.output;
  EXPECT_NEAR(before_m(), corrected_m, 0.005) << "its heading says what its columns are";
  const CommandResult na0 = Replay("whole.kmall adjusted.na0");
  ASSERT_EQ(na0.exit_code, 0) << na0.output;
  EXPECT_NEAR(before_m(), corrected_m, 0.005);
  const fs::path columns = Folder() / "adjusted.csv.yaml";
  std::ofstream(columns) << "header_lines: 1\n"
                            "columns:\n"
                            "  - {quantity: iso, column: 1}\n"
                            "  - {quantity: latitude, column: 2}\n"
                            "  - {quantity: longitude, column: 3}\n";
  const CommandResult csv = Replay("whole.kmall adjusted.csv");
  ASSERT_EQ(csv.exit_code, 0) << csv.output;
  EXPECT_NEAR(before_m(), corrected_m, 0.005);
  std::ofstream(columns) << "header_lines: 1\n"
                            "columns:\n"
                            "  - {quantity: iso, name: time}\n"
                            "  - {quantity: latitude, name: latitude_deg}\n"
                            "  - {quantity: longitude, name: longitude_deg}\n";
  const CommandResult named = Replay("whole.kmall adjusted.csv");
  ASSERT_EQ(named.exit_code, 0) << named.output;
  EXPECT_NEAR(before_m(), corrected_m, 0.005);
  std::ofstream(columns) << "header_lines: 1\ncolumns:\n  - {quantity: latitude, name: Lat}\n";
  EXPECT_THAT(Replay("whole.kmall adjusted.csv").output,
              HasSubstr("adjusted.csv.yaml: columns: the last header line has no 'Lat'"));
  std::ofstream(columns) << "columns:\n  - {quantity: lat, column: 2}\n";
  const CommandResult wrong = Replay("whole.kmall adjusted.csv");
  EXPECT_EQ(wrong.exit_code, 78) << wrong.output;
  EXPECT_THAT(wrong.output, HasSubstr("adjusted.csv.yaml: columns: 'lat' is no quantity"));
  fs::remove(columns);
  EXPECT_EQ(Replay("adjusted.na0").exit_code, 65) << "no sounding";
}

TEST_F(SeveralDives, TheTideIsTakenOffEveryDepth) {
  ASSERT_EQ(Replay("whole.kmall").exit_code, 0);
  const double below_water_m = DepthOfFirstSubmap();
  const fs::path tide = Folder() / "tide.csv";
  std::ofstream(tide) << "time,level\n2000-01-01T00:00Z,1.25\n2100-01-01T00:00Z,1.25\n";
  const CommandResult corrected = Replay("whole.kmall", "--water-level " + tide.string());
  ASSERT_EQ(corrected.exit_code, 0) << corrected.output;
  EXPECT_NEAR(DepthOfFirstSubmap(), below_water_m - 1.25, 0.001);
  std::ofstream(tide) << "2026-05-02T10:00Z,1\n2026-05-02T11:00Z,high\n";
  const CommandResult wrong = Replay("whole.kmall", "--water-level " + tide.string());
  EXPECT_EQ(wrong.exit_code, 78) << wrong.output;
  EXPECT_THAT(wrong.output, HasSubstr("tide.csv:2: 'high' is not a number of metres"));
}

// The simulated water line is on the ellipsoid. A zero of depth 1.25 m below the ellipsoid makes
// every depth 1.25 m smaller, whichever file states the height. The middle ping of a submap may be
// another one.
TEST_F(SeveralDives, HeightsAboveTheEllipsoidTakeThePlaceOfATideGauge) {
  ASSERT_EQ(Replay("whole.kmall").exit_code, 0);
  const double below_water_m = DepthOfFirstSubmap();
  for (const char* const name : {"navigation.sbet", "navigation.csv"})
    fs::copy_file(
        out_.path() / "map/export" / name, Folder() / name, fs::copy_options::overwrite_existing);
  std::ofstream(Folder() / "navigation.csv.yaml")
      << "header_lines: 1\n"
         "columns:\n"
         "  - {quantity: iso, column: 1}\n"
         "  - {quantity: latitude, column: 2}\n"
         "  - {quantity: longitude, column: 3}\n"
         "  - {quantity: height, column: 4, scale: -1}\n";
  for (const char* const name : {"plain.all", "heights.s7k"})
    WriteSurveyFile({Folder() / "l.lcmlog",
                     InsAtDatum(ConfigFile("mapper_ins_tactical.yaml")),
                     Folder() / name});
  std::ofstream(Folder() / "heights.all", std::ios::binary)
      << WithHeightDatagrams(TextOf(Folder() / "plain.all"), 0.0);
  const auto config = [this](const std::string& more) {
    const fs::path path = Folder() / "heights.yaml";
    std::ofstream(path) << "vehicle: " << ConfigFile("vehicle.yaml")
                        << "\nellipsoid_heights: {use: true, " << more << "}\n";
    return "--config " + path.string();
  };
  for (const char* const files : {"whole.kmall",
                                  "heights.s7k",
                                  "heights.all",
                                  "whole.kmall navigation.sbet",
                                  "whole.kmall navigation.csv"}) {
    const CommandResult result = Replay(files, config("separation_m: -1.25"));
    ASSERT_EQ(result.exit_code, 0) << files << result.output;
    EXPECT_NEAR(DepthOfFirstSubmap(), below_water_m - 1.25, 0.05) << files;
  }
  // The zero of depth as a grid over positions.
  std::ofstream(Folder() / "zero.asc")
      << "ncols 1\nnrows 1\nxllcorner -75\nyllcorner 40\ncellsize 10\n-2.5\n";
  ASSERT_EQ(Replay("whole.kmall", config("separation_grid: zero.asc")).exit_code, 0);
  EXPECT_NEAR(DepthOfFirstSubmap(), below_water_m - 2.5, 0.05);
  // A file without heights.
  EXPECT_NE(Replay("plain.all", config("separation_m: 0")).exit_code, 0);
  std::ofstream(Folder() / "zero.asc") << "ncols 1\n";
  const CommandResult wrong = Replay("whole.kmall", config("separation_grid: zero.asc"));
  EXPECT_EQ(wrong.exit_code, 78);
  EXPECT_THAT(wrong.output, HasSubstr("zero.asc: no ESRI ASCII grid: no nrows"));
}

// As docs/several-dives.md describes it: each survey has its own exit code and files, and a failed
// one is processed again alone.
TEST_F(SeveralDives, EightSurveysTwoAtATimeOfWhichOneIsDamaged) {
  if (RunCommand("command -v parallel").exit_code != 0) {
    GTEST_SKIP() << "no GNU parallel here";
  }
  const fs::path archive = out_.path() / "archive";
  for (int n = 1; n <= 8; ++n) {
    const fs::path survey = archive / ("s" + std::to_string(n));
    fs::create_directories(survey);
    fs::copy_file(Folder() / "whole.kmall", survey / "lines.kmall");
  }
  std::ofstream(archive / "s3" / "lines.kmall", std::ios::binary | std::ios::trunc)
      << TextOf(Folder() / "whole.kmall").substr(0, 5'000);
  fs::create_directories(out_.path() / "maps");
  const std::string command = "cd " + out_.path().string() +
                              " && PATH=" + fs::path(Program("seastitch")).parent_path().string() +
                              ":$PATH parallel -j 2 --joblog maps/jobs.txt ";
  const std::string jobs =
      "'seastitch replay --quiet {} --out maps/{/} > maps/{/}.txt 2>&1' ::: archive/*";
  // Exit code by job.
  const auto exit_codes = [this] {
    std::map<int, int> codes;
    std::istringstream lines(TextOf(out_.path() / "maps/jobs.txt"));
    std::string line;
    std::getline(lines, line);  // names of the columns
    while (std::getline(lines, line)) {
      std::istringstream columns(line);
      std::string host, start, runtime, send, receive;
      int job = 0, code = -1;
      columns >> job >> host >> start >> runtime >> send >> receive >> code;
      codes[job] = code;
    }
    return codes;
  };
  const auto run = RunCommand(command + jobs);
  EXPECT_EQ(run.exit_code, 1) << run.output;  // number of failed jobs
  const std::map<int, int> codes = exit_codes();
  ASSERT_EQ(codes.size(), 8u);
  for (const auto& [job, code] : codes) EXPECT_EQ(code, job == 3 ? 65 : 0) << job;
  EXPECT_FALSE(fs::exists(out_.path() / "maps/s3/elevation.tif"));
  const std::string said = TextOf(out_.path() / "maps/s3.txt");
  EXPECT_THAT(said, HasSubstr("seastitch: "));
  EXPECT_EQ(said.find('\n'), said.size() - 1) << said;
  const std::string first = TextOf(out_.path() / "maps/s1/elevation.tif");
  ASSERT_FALSE(first.empty());
  for (const char* const name : {"s2", "s4", "s5", "s6", "s7", "s8"})
    EXPECT_TRUE(TextOf(out_.path() / "maps" / name / "elevation.tif") == first) << name;

  fs::copy_file(Folder() / "whole.kmall",
                archive / "s3" / "lines.kmall",
                fs::copy_options::overwrite_existing);
  const auto mended = RunCommand(command + "--resume-failed " + jobs);
  EXPECT_EQ(mended.exit_code, 0) << mended.output;
  EXPECT_EQ(exit_codes().at(3), 0);
  EXPECT_TRUE(TextOf(out_.path() / "maps/s3/elevation.tif") == first);
}

TEST(DivesAmong, FoldersDaysAndLooseLogs) {
  const fs::path file = Shared("data/mbes/em2040_OS01.kmall");
  const fs::path other = Shared("data/mbes/em710_g.all");
  SKIP_WITHOUT(file);
  const TemporaryDir dir;
  fs::create_directories(dir.path() / "a");
  fs::create_directories(dir.path() / "b" / "a");
  fs::copy_file(file, dir.path() / "a" / "x.kmall");
  fs::copy_file(file, dir.path() / "b" / "a" / "y.kmall");
  std::ofstream(dir.path() / "a" / "notes.txt") << "not a survey file";
  const auto dives = DivesAmong({dir.path() / "a/",
                                 file,
                                 dir.path() / "one.lcmlog",
                                 other,
                                 dir.path() / "b" / "a",
                                 dir.path() / "two.lcmlog"});
  ASSERT_EQ(dives.size(), 5u);
  EXPECT_EQ(dives[0].name, "a");
  EXPECT_EQ(dives[0].files, std::vector<fs::path>{dir.path() / "a" / "x.kmall"});
  EXPECT_EQ(dives[1].files, std::vector<fs::path>{file});
  EXPECT_EQ(dives[1].name.size(), 10u);  // name by day
  EXPECT_EQ(dives[2].name, "logs");
  EXPECT_EQ(dives[2].files.size(), 2u);
  EXPECT_NE(dives[3].name, dives[1].name);
  EXPECT_EQ(dives[4].name, "a (2)");
}

}  // namespace
}  // namespace seastitch
