// The runs of a replay for self-calibration: when another follows, and what is told at the end.

#include "survey/replay/calibration_rounds.hpp"

#include <gtest/gtest.h>

#include "tests/mapper/calibration/simulated_survey.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

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
    Feeding feeding{true, [] { return false; }};
    rounds.Warn({}, &feeding);
    return feeding.warnings.size();
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

TEST_F(CalibrationRoundsOfADive, ChangeNothingWhereTheInputCannotBeReadAgain) {
  CalibrationRounds rounds(dir_.path(), true, false);
  EXPECT_FALSE(Run(&rounds, false));
  EXPECT_TRUE(dive_.mapper.calibration.IsZero());
  EXPECT_EQ(Reported(rounds).size(), 1u);
  EXPECT_EQ(Warnings(rounds), 0u);
  dive_.mapper.calibrate = false;
  EXPECT_EQ(CalibrationRounds(dir_.path(), true, true).Begin(0, &dive_), nullptr);
}

}  // namespace
}  // namespace seastitch
