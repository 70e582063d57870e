#include "survey/plan/survey_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "codecs/kongsberg/kmall.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tools/import.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::string Replay(const fs::path& file, const fs::path& out, const std::string& more = "") {
  return Program("seastitch") + " replay --quiet " + file.string() + " --out " + out.string() +
         more;
}

// Every real file gives a map with its own navigation.
TEST(SurveyFiles, RealFilesBecomeMaps) {
  for (const char* const name : {"em710_g.all",
                                 "em2040_ac.all",
                                 "em2040c_ay.all",
                                 "em2040_OS01.kmall",
                                 "em2040_eg.kmall",
                                 "gsf_v3_08.gsf",
                                 "r2sonic2026.xtf"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    TemporaryDir dir;
    const auto result = RunCommand(Replay(file, dir.path() / "map"));
    EXPECT_EQ(result.exit_code, 0) << name << ": " << result.output;
    EXPECT_TRUE(fs::exists(dir.path() / "map" / "elevation.tif")) << name;
  }
}

// Import and replay of the log, and replay of the file: without installation parameters, and with
// those of a transmitter in three parts.
TEST(SurveyFiles, ImportedLogGivesTheSameMapAsTheFile) {
  for (const char* const name : {"r2sonic2026.xtf", "em2040_OS01.kmall"}) {
    const fs::path file = Shared(std::string("data/mbes/") + name);
    SKIP_WITHOUT(file);
    TemporaryDir dir;
    const fs::path log = dir.path() / "a.lcmlog";
    const auto imported = RunCommand(Program("seastitch") + " import --quiet " + file.string() +
                                     " --log " + log.string());
    ASSERT_EQ(imported.exit_code, 0) << imported.output;
    const bool installed = imported.output.find("no installation parameters") == std::string::npos;
    EXPECT_EQ(installed, std::string(name) == "em2040_OS01.kmall");
    ASSERT_EQ(RunCommand(Replay(file, dir.path() / "file")).exit_code, 0);
    const auto replayed = RunCommand(Replay(log, dir.path() / "log"));
    ASSERT_EQ(replayed.exit_code, 0) << replayed.output;
    for (const char* const product : {"poses.txt", "graph.g2o", "elevation.tif"})
      EXPECT_TRUE(TextOf(dir.path() / "file" / product) == TextOf(dir.path() / "log" / product))
          << name << ' ' << product;
  }
}

// Every sounding of the file is exported, and those marked as used are those of the map.
TEST(SurveyFiles, SoundingsOfTheMapAreExported) {
  const fs::path file = Shared("data/mbes/em2040_OS01.kmall");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const auto result = RunCommand(Replay(file, dir.path() / "map", " --soundings las"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const std::string las = TextOf(dir.path() / "map/export/soundings.las");
  const auto report = nlohmann::json::parse(TextOf(dir.path() / "map/report.json"));
  std::uint32_t begin = 0;
  std::memcpy(&begin, las.data() + 96, sizeof begin);
  constexpr std::size_t kPoint = 38, kClass = 16;
  std::uint64_t used = 0;
  for (std::size_t at = begin; at < las.size(); at += kPoint) used += las[at + kClass] == 40;
  EXPECT_EQ(used, report["soundings"]["used"]);
  EXPECT_GT(used, 1000u);
  EXPECT_FALSE(fs::exists(dir.path() / "map/.soundings"));
}

// A real line over a flat bed. Its recorded stamps are right; with stamps 22 ms too late the report
// estimates this offset from the seabed.
TEST(SurveyFiles, SeabedSaysThatTheSonarsStampsAreOff) {
  const fs::path file = Shared("data/mbes/r2sonic2026.xtf");
  SKIP_WITHOUT(file);
  TemporaryDir dir;
  const auto added_by = [&](double configured_s) {
    const fs::path config = dir.path() / "mapper.yaml";
    std::ofstream(config) << "vehicle: " << (ConfigDir() / "vehicle.yaml").string()
                          << "\nsonar_time_offset_s: " << configured_s << "\n";
    const fs::path out = dir.path() / "map";
    const auto result = RunCommand(Replay(file, out, " --config " + config.string()));
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return nlohmann::json::parse(
        TextOf(out / "report.json"))["noise"]["sonar_time_offset"]["by_roll"];
  };
  const nlohmann::json as_recorded = added_by(0.0);
  EXPECT_LT(as_recorded["sigma_s"], 0.002);
  EXPECT_LT(std::abs(as_recorded["add_s"].get<double>()), 0.005);
  const nlohmann::json late = added_by(0.022);
  EXPECT_NEAR(late["add_s"], as_recorded["add_s"].get<double>() - 0.022, 0.002);
  EXPECT_LT(late["change_after"], 0.6 * late["change_before"].get<double>());
}

TEST(SurveyFiles, InstallationOfTheFileIsUsed) {
  const fs::path file = Shared("data/mbes/em710_g.all");
  SKIP_WITHOUT(file);
  const SurveyPlan plan = MakeSurveyPlan({file});
  const VehicleGeometry& vehicle = plan.vehicle;
  EXPECT_NEAR(vehicle.T_mbes_tx.translation().x(), 12.341, 1e-3);
  EXPECT_NEAR(vehicle.T_mbes_rx.translation().z(), 7.010, 1e-3);
  EXPECT_NE(plan.Text().find("water line 1.031 m down"), std::string::npos);
}

// #SPO of this file differs from its own raw GGA by the antenna's lever arm (-0.1 m, -0.1 m), and
// agrees with the reference point's position in #MRZ to 1 mm.
TEST(SurveyFiles, PositionsOfKmallAreOfTheReferencePoint) {
  const fs::path file = Shared("data/mbes/em2040_OS01.kmall");
  SKIP_WITHOUT(file);
  const SurveyPlan plan = MakeSurveyPlan({file});
  EXPECT_EQ(plan.position_source.substr(0, 4), "#SPO");
  EXPECT_TRUE(plan.vehicle.T_vehicle_imu.translation().isZero());
}

std::string PingsAlone() {
  std::string bytes;
  for (int i = 0; i < 10; ++i) {
    MbesPing ping;
    ping.time = FromUtime(1'700'000'000'000'000 + 100'000 * i);
    ping.sound_speed_mps = 1500.0;
    ping.beams.resize(50, {0.05f, 0.1f, 0, 0, 0, -20, kBeamValid | kBeamPhase});
    const auto datagram = EncodeMrz(ping, KmallHeader{});
    bytes.append(datagram.begin(), datagram.end());
  }
  return bytes;
}

TEST(SurveyFiles, AFileThatCannotBePlacedEndsWithOneLineThatSaysWhy) {
  TemporaryDir dir;
  const std::string file = dir.Write("a.kmall", PingsAlone());
  const auto result = RunCommand(Replay(file, dir.path() / "map"));
  EXPECT_EQ(result.exit_code, 65);
  EXPECT_EQ(result.output, "seastitch: " + file + ": no position in it to place soundings by\n");
  const auto empty = RunCommand(
      Replay(dir.Write("a.fnv",
                       "2024 05 02 10 20 30.5 1714645230.5 5.0 57.0 90.0 2.0 0 0 0 0 5 57 5 57\n"),
             dir.path() / "none"));
  EXPECT_EQ(empty.exit_code, 65) << empty.output;
  EXPECT_NE(empty.output.find("no sounding in it"), std::string::npos) << empty.output;
  EXPECT_FALSE(fs::exists(dir.path() / "map" / "elevation.tif"));
}

}  // namespace
}  // namespace seastitch
