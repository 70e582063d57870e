// Two dives of two vehicles in one map: each has its own mounting errors.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "products/track/truth.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/short_survey.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// What vehicle.yaml as shipped says of sonar and DVL, and how they are mounted in truth.
constexpr char kToldSonar[] = "position_m: [0.45, 0, 0.2]";
constexpr char kToldDvl[] = "position_m: [-0.6, 0, 0.15]";
struct Vehicle {
  std::string name;
  std::string sonar_m;
  std::string dvl_yaw;
  std::vector<std::pair<std::string, std::string>> plan;  // differences to bench/short.yaml
  // Mounting errors, as the report names them.
  double sonar_forward_m, sonar_starboard_m, dvl_yaw_deg;
};

std::vector<Vehicle> Vehicles() {
  return {{"first",
           "[-0.05, -0.3, 0.2]",
           "0.4",
           {{"lines: 3", "lines: 4"},
            {"length_m: 60.0", "length_m: 120.0"},
            {"crosslines: 0", "crosslines: 1"}},
           -0.5,
           -0.3,
           0.4},
          {"second",
           "[0.7, 0.35, 0.2]",
           "-0.5",
           {{"length_m: 60.0", "length_m: 110.0"},
            {"spacing_m: 20.0", "spacing_m: 27.0"},
            {"crosslines: 0", "crosslines: 2"}},
           0.25,
           0.35,
           -0.5}};
}

void Replace(const std::string& what,
             const std::string& with,
             std::size_t from,
             std::string* text) {
  const std::size_t at = text->find(what, from);
  ASSERT_NE(at, std::string::npos) << what;
  text->replace(at, what.size(), with);
}

// The delivered track of each dive in track.csv, where the times of a dive begin anew.
std::vector<std::vector<CorrectedState>> TracksOf(const fs::path& track_csv) {
  std::vector<std::vector<CorrectedState>> tracks;
  std::ifstream in(track_csv);
  std::string line;
  std::getline(in, line);  // names of the columns
  while (std::getline(in, line)) {
    std::vector<double> values;
    std::istringstream words(line);
    for (std::string word; values.size() < 11 && std::getline(words, word, ',');)
      values.push_back(std::stod(word));
    CorrectedState state;
    state.time = FromUtime(std::stoll(line));
    state.corrected = {values.at(7), values.at(8), Deg2Rad(values.at(10))};
    if (tracks.empty() || state.time < tracks.back().back().time) tracks.emplace_back();
    tracks.back().push_back(state);
  }
  return tracks;
}

class TwoVehicles : public ::testing::Test {
 protected:
  static const fs::path& Folder() {
    static const TemporaryDir dir;
    static const bool made = [] {
      for (const Vehicle& vehicle : Vehicles()) MakeDive(vehicle, dir.path());
      const fs::path told = dir.path() / "told";
      fs::copy(SourceDir() / "config", told, fs::copy_options::recursive);
      // Navigation takes the DVL's angle as known, so that all of it is left to the graph.
      std::string mapper = TextOf(told / "mapper_ins_tactical.yaml");
      Replace("dvl_mounting_deg: 0.1", "dvl_mounting_deg: 0.02", 0, &mapper);
      std::ofstream(told / "mapper_ins_tactical.yaml")
          << mapper
          << "\n  start_at_first_fix: false\n"
             "sonar_mounting_sigma_m: 0.5\nsonar_mounting_sigma_deg: 0.5\n";
      return true;
    }();
    EXPECT_TRUE(made);
    return dir.path();
  }

  static void MakeDive(const Vehicle& vehicle, const fs::path& folder) {
    const fs::path config = folder / ("config_" + vehicle.name);
    fs::copy(SourceDir() / "config", config, fs::copy_options::recursive);
    std::string yaml = TextOf(config / "vehicle.yaml");
    Replace(kToldSonar, "position_m: " + vehicle.sonar_m, 0, &yaml);
    Replace("roll_pitch_yaw_deg: [0, 0, 0]",
            "roll_pitch_yaw_deg: [0, 0, " + vehicle.dvl_yaw + "]",
            yaml.find(kToldDvl),
            &yaml);
    std::ofstream(config / "vehicle.yaml") << yaml;
    std::string survey = ShortSurveyUnderWater();
    Replace("mems", "ins_tactical", 0, &survey);
    for (const auto& [what, with] : vehicle.plan) Replace(what, with, 0, &survey);
    std::ofstream(folder / (vehicle.name + ".yaml")) << survey;
    fs::create_directories(folder / vehicle.name);
    const auto bench = RunCommand(
        "cd " + folder.string() + " && " + Program("seastitch") + " bench --survey " +
        vehicle.name + ".yaml --config-dir " + config.string() + " --log " + vehicle.name +
        "/log.lcmlog && mv " + vehicle.name + "/log.lcmlog.truth.csv " + vehicle.name + ".csv");
    ASSERT_EQ(bench.exit_code, 0) << bench.output;
  }

  // As if vehicle.yaml as shipped were that of both.
  void ReplayWrong(const std::string& dives) {
    Replay(dives, "--config " + (Folder() / "told/mapper_ins_tactical.yaml").string());
  }
  void Replay(const std::string& dives, const std::string& more) {
    const CommandResult result =
        RunCommand("cd " + Folder().string() + " && " + Program("seastitch") + " replay --quiet " +
                   dives + " --out " + (out_.path() / "map").string() + " " + more);
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  nlohmann::json Report() const {
    return nlohmann::json::parse(TextOf(out_.path() / "map/report.json"));
  }
  // Shape error [m] of one dive in the delivered map.
  double Shape(std::size_t place, const std::string& dive) const {
    const auto tracks = TracksOf(out_.path() / "map/track.csv");
    const auto errors = CompareWithTruth(tracks.at(place), ReadTruth(Folder() / (dive + ".csv")));
    return errors->after_aligned.position_rms_m;
  }

  TemporaryDir out_;
};

// Largest error in sigmas of what the report says of a dive's mounting.
double WorstError(const nlohmann::json& mounting, const Vehicle& truth) {
  double worst = 0.0;
  const auto add = [&](const char* name, double value) {
    const double sigma = mounting.at(name).at("sigma");
    worst = std::max(worst, std::abs(mounting.at(name).at("value").get<double>() - value) / sigma);
  };
  add("sonar_forward_m", truth.sonar_forward_m);
  add("sonar_starboard_m", truth.sonar_starboard_m);
  add("dvl_yaw_deg", truth.dvl_yaw_deg);
  return worst;
}

TEST_F(TwoVehicles, ToldWrongInTheSameWayHaveTheirOwnErrorsInOneMap) {
  const std::vector<Vehicle> vehicles = Vehicles();
  std::vector<double> alone_m;
  for (const Vehicle& vehicle : vehicles) {
    ReplayWrong(vehicle.name);
    EXPECT_LT(WorstError(Report()["mounting"], vehicle), 3.0) << vehicle.name;
    alone_m.push_back(Shape(0, vehicle.name));
  }
  ReplayWrong("first second");
  const nlohmann::json report = Report();
  EXPECT_EQ(report["outcome"], "corrected");
  EXPECT_FALSE(report.contains("mounting"));
  ASSERT_EQ(report["dives"].size(), 2u);
  EXPECT_GE(report["dives"][0]["closures_with"]["second"], 5);
  for (std::size_t k = 0; k < vehicles.size(); ++k) {
    const nlohmann::json& mounting = report["dives"][k]["mounting"];
    EXPECT_LT(WorstError(mounting, vehicles[k]), 3.0) << mounting;
    EXPECT_LT(mounting["sonar_forward_m"]["sigma"], 0.05);
    const double together_m = Shape(k, vehicles[k].name);
    std::printf("%s: shape %.3f m alone, %.3f m with the other; mounting %s\n",
                vehicles[k].name.c_str(),
                alone_m[k],
                together_m,
                mounting.dump().c_str());
    EXPECT_LT(together_m, 1.2 * alone_m[k]);
  }
  EXPECT_THAT(TextOf(out_.path() / "map/report.html"),
              HasSubstr("second, against its vehicle.yaml"));
}

// The configuration that each log recorded says where its sonar stands.
TEST_F(TwoVehicles, ToldRightHaveNoErrors) {
  Replay("first second", "");
  const nlohmann::json report = Report();
  EXPECT_EQ(report["outcome"], "corrected");
  for (const nlohmann::json& dive : report["dives"])
    EXPECT_LT(WorstError(dive["mounting"], {}), 3.0) << dive;
}

}  // namespace
}  // namespace seastitch
