// What dead reckoning makes of sensors and clocks that are wrong, on one simulated dive each.
// seastitch-bench-navigation --faults prints the same for more of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "mapper/navigation/dead_reckoning.hpp"
#include "tests/mapper/navigation/fault_cases.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"
#include "tests/mapper/navigation/fault_score.hpp"
#include "tests/support/paths.hpp"

namespace seastitch::test {
namespace {

const Dive& CleanDive() {
  static const Dive dive = SimulatedDive(1);
  return dive;
}

FilterScore ScoreOf(const FaultCase& fault) {
  Dive dive = CleanDive();
  fault.apply(&dive);
  return ScoreFilter(dive, std::isfinite(fault.to_s) ? fault.to_s : -1.0);
}

TrackScore BaselineOf(const FaultCase& fault) {
  Dive dive = CleanDive();
  fault.apply(&dive);
  return ScoreBaseline(dive);
}

class Fault : public testing::TestWithParam<FaultCase> {};

TEST_P(Fault, IsNoWorseThanDeadReckoningWithoutAFilterAndNeverRunsAway) {
  const FilterScore score = ScoreOf(GetParam());
  const TrackScore baseline = BaselineOf(GetParam());
  EXPECT_LT(score.rms_m, std::max(1.5 * baseline.rms_m, 2.0));
  EXPECT_LT(score.largest_m, std::max(1.5 * baseline.largest_m, 2.0));
  EXPECT_LT(score.largest_m, std::max(0.03 * DistanceM(CleanDive()), 12.0));
  EXPECT_LE(score.largest_speed_mps, CleanDive().params.max_speed_mps);
  if (GetParam().to_s < 0.0) return;
  ASSERT_TRUE(score.recovery_s);
  EXPECT_LE(*score.recovery_s, 60.0);
}

INSTANTIATE_TEST_SUITE_P(Faults,
                         Fault,
                         testing::Values(LateAttitude(0.45),
                                         LateDvl(0.5),
                                         AttitudeEvery(1.0),
                                         HeadingStep(20.0, 195.0, 315.0),
                                         WrongVelocities(195.0, 30.0),
                                         Stuck(StuckSensor::kGyro, 195.0, 10.0),
                                         Stuck(StuckSensor::kGyro, 195.0, 30.0),
                                         Stuck(StuckSensor::kAccelerometer, 195.0, 120.0),
                                         Stuck(StuckSensor::kAttitude, 195.0, 120.0),
                                         InertialGap(195.0, 10.0)),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::replace_if(
                               name.begin(),
                               name.end(),
                               [](char c) { return !std::isalnum(c); },
                               '_');
                           return name;
                         });

TEST(Faults, TheDelayOfAnAttitudesStampsIsFound) {
  EXPECT_TRUE(ScoreOf(LateAttitude(0.0)).offsets.empty());
  for (const double delay_s : {0.1, 0.45}) {
    const FilterScore score = ScoreOf(LateAttitude(delay_s));
    ASSERT_EQ(score.offsets.size(), 1u);
    EXPECT_EQ(score.offsets[0].sensor, NavSensor::kAttitude);
    EXPECT_NEAR(score.offsets[0].add_s, -delay_s, 3.0 * score.offsets[0].sigma_s);
    EXPECT_LT(score.offsets[0].sigma_s, 0.02);
  }
}

// A step looks like a turn that one of the two sensors has at another time. Nor does a dive without
// one, at any moment.
TEST(Faults, AStepOfTheHeadingRaisesNoDelay) {
  for (const FaultCase& step : {LateAttitude(0.0),
                                HeadingStep(5.0, 130.0, 1e9),
                                HeadingStep(20.0, 195.0, 315.0),
                                HeadingStep(90.0, 60.0, 100.0)}) {
    Dive dive = CleanDive();
    step.apply(&dive);
    DeadReckoning navigation(dive.params, dive.vehicle);
    std::size_t dvl = 0;
    for (const ImuSample& imu : dive.imu) {
      navigation.Add(imu);
      for (; dvl < dive.dvl.size() && dive.dvl[dvl].time <= imu.time; ++dvl)
        navigation.Add(dive.dvl[dvl]);
      ASSERT_TRUE(navigation.suspected_offsets().empty())
          << step.name << ", after " << ToSeconds(imu.time - dive.imu[0].time) << " s";
    }
  }
}

TEST(Faults, TheDelayOfADopplerLogsStampsIsFound) {
  EXPECT_TRUE(ScoreOf(LateDvl(0.0)).offsets.empty());
  for (const double delay_s : {0.1, 0.5, 1.0}) {
    const FilterScore score = ScoreOf(LateDvl(delay_s));
    ASSERT_EQ(score.offsets.size(), 1u);
    EXPECT_EQ(score.offsets[0].sensor, NavSensor::kDvl);
    EXPECT_NEAR(score.offsets[0].add_s, -delay_s, 3.0 * score.offsets[0].sigma_s);
    EXPECT_LT(score.offsets[0].sigma_s, 0.02);
    EXPECT_LT(score.largest_m, 2.0);
  }
}

TEST(Faults, ADelayThatChangesIsFoundAgain) {
  Dive dive = CleanDive();
  LateAttitude(0.1).apply(&dive);
  Dive later = CleanDive();
  LateAttitude(0.3).apply(&later);
  for (std::size_t i = 0; i < dive.imu.size(); ++i)
    if (ToSeconds(dive.imu[i].time - dive.imu[0].time) > 300.0) dive.imu[i] = later.imu[i];
  const FilterScore score = ScoreFilter(dive, -1.0);
  ASSERT_EQ(score.offsets.size(), 1u);
  EXPECT_NEAR(score.offsets[0].add_s, -0.3, 0.01);
}

// Put right by the configuration it is as if the clock had been right.
TEST(Faults, AConfiguredOffsetPutsTheStampsRight) {
  Dive dive = CleanDive();
  LateAttitude(0.2).apply(&dive);
  dive.params.attitude_time_offset_s = -0.2;
  const FilterScore score = ScoreFilter(dive, -1.0);
  EXPECT_TRUE(score.offsets.empty());
  EXPECT_LT(score.largest_m, 1.2);
}

TEST(Faults, AConfiguredOffsetPutsTheStampsOfTheDopplerLogRight) {
  Dive dive = CleanDive();
  LateDvl(0.5).apply(&dive);
  dive.params.dvl_time_offset_s = -0.5;
  const FilterScore score = ScoreFilter(dive, -1.0);
  EXPECT_TRUE(score.offsets.empty());
  EXPECT_LT(score.largest_m, 1.2);
}

TEST(Faults, EarlyStampsAreFound) {
  const FilterScore score = ScoreOf(LateDvl(-0.2));
  ASSERT_EQ(score.offsets.size(), 1u);
  EXPECT_NEAR(score.offsets[0].add_s, 0.2, 3.0 * score.offsets[0].sigma_s);
}

// A real run that ran away: 32 km off, with bottom lock all the time.
TEST(Faults, ARealRunWithLateAttitudeDoesNotRunAway) {
  std::optional<Dive> run = AkitDive(Shared("data/akit"), "T6");
  if (!run) GTEST_SKIP() << "the run is not at " << Shared("data/akit");
  Dive& dive = *run;
  LateAttitude(0.45).apply(&dive);
  const FilterScore score = ScoreFilter(dive, -1.0);
  EXPECT_LE(score.largest_m, std::max(0.03 * DistanceM(dive), 12.0));
  EXPECT_LE(score.largest_m, std::max(1.5 * ScoreBaseline(dive).largest_m, 2.0));
  EXPECT_LE(score.largest_speed_mps, dive.params.max_speed_mps);
}

// Longer than a turn: wrong in the vehicle's axes, they are as wrong after it.
TEST(Faults, WrongVelocitiesOfTwoMinutesAreRefusedThroughATurn) {
  const FaultCase wrong = WrongVelocities(195.0, 120.0);
  Dive told = CleanDive();
  wrong.tell(&told);
  const FilterScore score = ScoreOf(wrong);
  EXPECT_LT(score.largest_m, 1.5 * ScoreFilter(told, -1.0).largest_m);
  EXPECT_LT(2.0 * score.worst_nees, 9.0);
  EXPECT_EQ(score.counters.count("accelerometer_doubted"), 0u);
}

TEST(Faults, AHeadingThatStepsAndStaysLeavesBothHypothesesInTheCovariance) {
  const FaultCase stays = HeadingStep(5.0, 195.0, 1e9);
  Dive told = CleanDive();
  stays.tell(&told);
  const FilterScore score = ScoreOf(stays);
  EXPECT_LT(score.largest_m, ScoreFilter(told, -1.0).largest_m + 2.0);
  EXPECT_LT(2.0 * score.worst_nees, 9.0);
  EXPECT_EQ(score.counters.at("heading_step"), 1);
  EXPECT_GT(score.sigma_m, 3.0);
  const FilterScore back = ScoreOf(HeadingStep(5.0, 195.0, 315.0));
  EXPECT_EQ(back.counters.at("heading_step_back"), 1);
  EXPECT_LT(back.sigma_m, 3.0);
}

}  // namespace
}  // namespace seastitch::test
