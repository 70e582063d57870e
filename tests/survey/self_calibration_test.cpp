// `seastitch replay` of surveys whose sonar has errors that nobody configured: the bench makes them
// in its devices.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/calibration.hpp"
#include "products/warning.hpp"
#include "survey/replay/calibration_rounds.hpp"
#include "tests/mapper/calibration/simulated_survey.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char kSurvey[] =
    "seed: 104\n"
    "terrain: {depth_m: 22.0, relief: {rms_m: 0.25, longest_m: 60.0, shortest_m: 1.0, hurst: "
    "0.9}}\n"
    "plan: {lines: 4, line_length_m: 80.0, spacing_m: 20.0, turn_radius_m: 8.0, crosslines: 1,\n"
    "       lead_in_m: 8.0, speed_mps: 1.5, altitude_m: 11.0}\n"
    "motion: {roll_rms_deg: 1.5, pitch_rms_deg: 0.7, heading_rms_deg: 1.0, heave_rms_m: 0.05,\n"
    "         period_s: 6.0}\n"
    "errors: {class: ins_tactical}\n";

class SelfCalibratingReplay : public ::testing::Test {
 protected:
  fs::path LogWith(const std::string& sonar, const std::string& folder = ".") {
    fs::create_directories(dir_ / folder);
    const fs::path survey = dir_ / "survey.yaml", log = dir_ / folder / "survey.lcmlog";
    std::ofstream(survey) << kSurvey << "mbes: {beams: 96, swath_deg: 120.0, ping_rate_hz: 5.0"
                          << sonar << "}\n";
    const CommandResult made = RunCommand(Program("seastitch") + " bench --survey " +
                                          survey.string() + " --log " + log.string());
    EXPECT_EQ(made.exit_code, 0) << made.output;
    return log;
  }
  Json ReportOf(const std::string& inputs, const std::string& more, int status = 0) {
    const fs::path out = dir_ / "out";
    const CommandResult done = RunCommand(Program("seastitch") + " replay " + inputs +
                                          " --quiet --out " + out.string() + " " + more);
    EXPECT_EQ(done.exit_code, status) << done.output;
    return Json::parse(std::ifstream(out / "report.json"));
  }
  static double Surface(const Json& report) { return report["surface_rms_m"]["after"]; }
  static double Used(const Json& report, const char* name) {
    return report["calibration"].back()["used"][name];
  }

  TemporaryDir dir_;
};

TEST_F(SelfCalibratingReplay, FindsErrorsByOverlapsAndMapsWithoutThem) {
  const fs::path log =
      LogWith(", errors: {mounting_roll_deg: 0.3, steering_mps: 3.0, stamp_s: 0.02}");
  const Json as_configured = ReportOf(log.string(), "--no-calibration");
  EXPECT_TRUE(as_configured["calibration"].empty());
  const Json report = ReportOf(log.string(), "--fail-on-warning", 3);
  ASSERT_EQ(report["calibration"].size(), 2u);
  EXPECT_NEAR(Used(report, "roll_deg"), 0.3, 0.03);
  EXPECT_NEAR(Used(report, "smile_mps"), 3.0, 0.4);
  EXPECT_NEAR(Used(report, "attitude_latency_ms"), 20.0, 3.0);
  EXPECT_EQ(Used(report, "heave_scale_percent"), 0.0);
  EXPECT_LT(Surface(report), 0.6 * Surface(as_configured));
  ASSERT_EQ(report["warnings"].size(), 1u);
  EXPECT_EQ(report["warnings"][0]["code"], NameOf(WarningCode::kCalibrated));

  // The next survey, with what this one suggests.
  std::string section;
  for (const Json& advice : report["advice"]) {
    const std::string key = advice["key"];
    constexpr char kSection[] = "calibration.";
    if (key.rfind(kSection, 0) != 0) continue;
    section += (section.empty() ? "" : ", ") + key.substr(sizeof kSection - 1) + ": " +
               advice["suggested"].get<std::string>();
  }
  const fs::path config = dir_ / "config";
  fs::copy(ConfigFile(""), config, fs::copy_options::recursive);
  std::ofstream(config / "mapper_ins_tactical.yaml", std::ios::app)
      << "\ncalibration: {" << section << "}\n";
  const Json next =
      ReportOf(log.string(), "--config " + (config / "mapper_ins_tactical.yaml").string());
  ASSERT_EQ(next["calibration"].size(), 1u);
  EXPECT_NEAR(Used(next, "roll_deg"), Used(report, "roll_deg"), 0.001);
  EXPECT_LT(Surface(next), 1.05 * Surface(report));
  for (const Json& advice : next["advice"])
    EXPECT_NE(advice["key"].get<std::string>().rfind("calibration.", 0), 0u) << advice;
}

TEST_F(SelfCalibratingReplay, IsOfEachOfSeveralDives) {
  const fs::path right = LogWith("", "right").parent_path();
  const fs::path wrong = LogWith(", errors: {mounting_roll_deg: 0.4}", "wrong").parent_path();
  const Json report = ReportOf(wrong.string() + " " + right.string(), "--fail-on-warning", 3);
  ASSERT_EQ(report["dives"].size(), 2u);
  for (const Json& dive : report["dives"]) {
    const bool is_wrong = dive["name"] == "wrong";
    ASSERT_EQ(dive["calibration"].size(), is_wrong ? 2u : 1u);
    EXPECT_NEAR(
        dive["calibration"].back()["used"]["roll_deg"].get<double>(), is_wrong ? 0.4 : 0.0, 0.03);
  }
  ASSERT_EQ(report["advice"].size(), 1u);
  EXPECT_EQ(report["advice"][0]["file"], "mapper.yaml of wrong");
}

TEST_F(SelfCalibratingReplay, AppliesNothingWhereNothingIsWrong) {
  const Json report = ReportOf(LogWith("").string(), "--fail-on-warning");
  ASSERT_EQ(report["calibration"].size(), 1u);
  EXPECT_GT(report["calibration"][0]["cells"], 3000);
}

// ---- the runs: when another follows, and what is told at the end

const SonarCalibration kError{.roll_rad = Deg2Rad(0.4)};

class CalibrationRoundsOfADive : public ::testing::Test {
 protected:
  CalibrationRoundsOfADive() { dive_.mapper.vehicle.T_vehicle_mbes = test::kSonar; }
  // A run of a survey whose sonar has what is left of an error.
  bool Run(CalibrationRounds* rounds, bool is_stopped) {
    SonarCalibration left = kError;
    left.roll_rad -= dive_.mapper.calibration.roll_rad;
    const test::Mapped mapped = test::Simulated(test::kThreeAndACross, left, 1);
    SelfCalibration* const calibration = rounds->Begin(0, &dive_);
    Survey survey;
    for (std::size_t i = 0; i < mapped.soundings.size(); ++i) {
      SubmapSoundings soundings = mapped.soundings[i];
      soundings.id = SubmapId{static_cast<std::int32_t>(i)};
      calibration->Add(soundings);
      SurveySubmap submap;
      submap.id = soundings.id;
      submap.frame_time = mapped.times[i];
      const Pose2& pose = mapped.T_map_level[i];
      submap.T_map_submap =
          MakePose({pose.x, pose.y, mapped.z_m[i]}, RotationFromRpy(0.0, 0.0, pose.yaw));
      survey.submaps.push_back(submap);
    }
    return rounds->EndRun(survey, is_stopped);
  }
  std::vector<CalibrationEstimate> Reported(const CalibrationRounds& rounds) {
    std::vector<DiveReport> reports(1);
    rounds.Report(&reports);
    return reports[0].calibration;
  }
  std::size_t Warnings(const CalibrationRounds& rounds) {
    ReplayInput replay_input{true, [] { return false; }};
    rounds.Warn({}, &replay_input);
    return replay_input.warnings.size();
  }

  TemporaryDir dir_;
  Dive dive_;
};

TEST_F(CalibrationRoundsOfADive, MapAgainUntilNothingIsClear) {
  CalibrationRounds rounds(dir_.path(), true, true);
  EXPECT_TRUE(Run(&rounds, false));
  EXPECT_NEAR(dive_.mapper.calibration.roll_rad, kError.roll_rad, Deg2Rad(0.03));
  EXPECT_FALSE(Run(&rounds, false));
  EXPECT_EQ(Reported(rounds).size(), 2u);
  EXPECT_EQ(Warnings(rounds), 1u);
  EXPECT_TRUE(std::filesystem::is_empty(dir_.path()));
}

// The depths of a part are moved like those of the whole, and that is said.
TEST_F(CalibrationRoundsOfADive, TellOfAMapThatWasStoppedInItsSecondRun) {
  CalibrationRounds rounds(dir_.path(), true, true);
  EXPECT_TRUE(Run(&rounds, false));
  EXPECT_FALSE(Run(&rounds, true));
  ASSERT_EQ(Reported(rounds).size(), 2u);
  EXPECT_EQ(Reported(rounds).back().used, dive_.mapper.calibration);
  EXPECT_EQ(Warnings(rounds), 1u);
}

TEST_F(CalibrationRoundsOfADive, ChangeNothingWhereNothingCanBeMappedAgain) {
  CalibrationRounds rounds(dir_.path(), true, false);
  EXPECT_FALSE(Run(&rounds, false));
  EXPECT_TRUE(dive_.mapper.calibration.IsZero());
  EXPECT_EQ(Reported(rounds).size(), 1u);
  EXPECT_EQ(Warnings(rounds), 0u);
  CalibrationRounds withheld(dir_.path(), true, true);
  withheld.Withhold();
  EXPECT_FALSE(Run(&withheld, false));
  EXPECT_TRUE(dive_.mapper.calibration.IsZero());
  dive_.mapper.calibrate = false;
  EXPECT_EQ(CalibrationRounds(dir_.path(), true, true).Begin(0, &dive_), nullptr);
}

}  // namespace
}  // namespace seastitch
