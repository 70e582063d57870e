// How dead reckoning comes back: what is wrong, for how long, and that it is right again after.

#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/navigation_params.hpp"
#include "tests/mapper/navigation/fault_cases.hpp"
#include "tests/mapper/navigation/fault_dives.hpp"
#include "tests/mapper/navigation/fault_score.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

namespace seastitch::test {
namespace {

const Dive& CleanDive() {
  static const Dive dive = SimulatedDive(1);
  return dive;
}

DeadReckoning Navigate(const Dive& dive) {
  NavigationParams params = dive.params;
  params.pose_window_s = params.window_s = 3600.0;
  DeadReckoning navigation(params, dive.vehicle);
  FeedDive(dive, &navigation);
  return navigation;
}

struct Error {
  double position_m;
  double velocity_mps;
  double heading_rad;
  double heading_sigma_rad;
};

Error ErrorAt(const Dive& dive, const DeadReckoning& navigation, std::size_t second) {
  const TruthSample& truth = dive.truth.at(second);
  const NavState state = navigation.StateAt(truth.time).value();
  const Eigen::Vector3d p = state.T_map_vehicle.translation() - truth.T_map_vehicle.translation();
  const double yaw = RpyFromRotation(state.T_map_vehicle.linear()).z() -
                     RpyFromRotation(truth.T_map_vehicle.linear()).z();
  return {p.head<2>().norm(),
          (state.v_map_mps - truth.v_map_mps).norm(),
          std::abs(WrapAngle(yaw)),
          std::sqrt(state.covariance(5, 5))};
}

double PositionSigmaM(const Dive& dive, const DeadReckoning& navigation, std::size_t second) {
  const NavState state = navigation.StateAt(dive.truth.at(second).time).value();
  return std::sqrt(state.covariance.topLeftCorner<2, 2>().trace());
}

// Calls act(ensemble) for those from from_s to to_s.
template <class Act>
void ForDvl(Dive* dive, double from_s, double to_s, const Act& act) {
  for (DvlSample& dvl : dive->dvl) {
    const double t = ToSeconds(dvl.time - dive->imu[0].time);
    if (t >= from_s && t < to_s) act(&dvl);
  }
}

void ShiftDvl(Dive* dive, double from_s, double to_s, double starboard_mps) {
  const Eigen::Vector3d shift =
      dive->vehicle.T_vehicle_dvl.linear().transpose() * Eigen::Vector3d(0.0, starboard_mps, 0.0);
  ForDvl(dive, from_s, to_s, [&](DvlSample* dvl) { dvl->v_dvl_mps += shift; });
}

void LoseLock(Dive* dive, double from_s, double to_s) {
  ForDvl(dive, from_s, to_s, [](DvlSample* dvl) { dvl->bottom_lock = false; });
}

// Roll and pitch.
double TiltErrorRad(const Dive& dive, const DeadReckoning& navigation, std::size_t second) {
  const NavState state = navigation.StateAt(dive.truth.at(second).time).value();
  const Eigen::Vector3d rpy = RpyFromRotation(state.T_map_vehicle.linear()) -
                              RpyFromRotation(dive.truth.at(second).T_map_vehicle.linear());
  return rpy.head<2>().norm();
}

void EndAttitude(Dive* dive, double from_s) {
  for (ImuSample& imu : dive->imu)
    if (ToSeconds(imu.time - dive->imu[0].time) > from_s) imu.attitude.reset();
}

PositionFix FixAt(const Dive& dive, std::size_t second, double sigma_m) {
  const TruthSample& truth = dive.truth.at(second);
  const GeographicLib::LocalCartesian map(
      Rad2Deg(dive.vehicle.datum.latitude_rad), Rad2Deg(dive.vehicle.datum.longitude_rad), 0.0);
  const Eigen::Vector3d p = truth.T_map_vehicle.translation();
  double latitude = 0.0;
  double longitude = 0.0;
  double height = 0.0;
  map.Reverse(p.y(), p.x(), 0.0, latitude, longitude, height);
  PositionFix fix;
  fix.time = truth.time;
  fix.latitude_rad = Deg2Rad(latitude);
  fix.longitude_rad = Deg2Rad(longitude);
  fix.covariance_north_east_m2 = sigma_m * sigma_m * Eigen::Matrix2d::Identity();
  fix.source = "usbl";
  return fix;
}

// --- two hypotheses of the heading
// ----------------------------------------------------------------

TEST(Recovery, AHeadingThatWasFollowedIsGivenUpWhenTheDeviceStepsBack) {
  Dive dive = CleanDive();
  HeadingStep(20.0, 100.0, 220.0).apply(&dive);
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_GT(ErrorAt(dive, navigation, 200).heading_rad, Deg2Rad(15.0));
  const Error after = ErrorAt(dive, navigation, 230);
  EXPECT_LT(after.heading_rad, Deg2Rad(1.5));
  EXPECT_LT(after.heading_sigma_rad, Deg2Rad(1.0));
  EXPECT_LT(after.position_m, 3.0);
  EXPECT_EQ(navigation.counters().at("heading_step_back"), 1);
  EXPECT_GE(navigation.counters().at("position_moved_cm"), 100);
}

TEST(Recovery, PositionsDecideWhichHeadingIsRight) {
  constexpr double kForeverS = std::numeric_limits<double>::infinity();
  // Followed, being early, and kept.
  for (const double from_s : {100.0, 195.0}) {
    Dive dive = CleanDive();
    dive.params.fuse_position_fixes = true;
    HeadingStep(20.0, from_s, kForeverS).apply(&dive);
    for (const std::size_t second : {280u, 300u}) dive.fixes.push_back(FixAt(dive, second, 1.0));
    const DeadReckoning navigation = Navigate(dive);
    EXPECT_GT(ErrorAt(dive, navigation, 270).heading_sigma_rad, Deg2Rad(15.0));
    const Error after = ErrorAt(dive, navigation, 310);
    EXPECT_LT(after.heading_rad, Deg2Rad(2.0)) << from_s;
    EXPECT_LT(after.heading_sigma_rad, Deg2Rad(2.0)) << from_s;
    EXPECT_LT(after.position_m, 4.0) << from_s;
  }
}

// The heading is not known better than by the device at its best, however often it says so.
TEST(Recovery, ASigmaThatGoesUpAndDownMakesNothingSurer) {
  Dive dive = CleanDive();
  const double sigma_rad = dive.params.attitude_heading_rad.sigma;
  for (std::size_t i = 0; i < dive.imu.size(); ++i) {
    const bool more = i / 500 % 2 == 1;  // by turns of 5 s
    dive.imu[i].attitude->sigma_rpy_rad.setConstant(more ? 5.0 * sigma_rad : 0.0);
  }
  const Error error = ErrorAt(dive, Navigate(dive), 590);
  const Error steady = ErrorAt(CleanDive(), Navigate(CleanDive()), 590);
  EXPECT_GT(error.heading_sigma_rad, 0.9 * steady.heading_sigma_rad);
  EXPECT_LT(error.heading_rad, 3.0 * error.heading_sigma_rad);
}

// --- position
// -------------------------------------------------------------------------------------

TEST(Recovery, FixesThatAgreeOverruleAWrongPosition) {
  Dive dive = CleanDive();
  dive.params.fuse_position_fixes = true;
  dive.params.start_north_m = 300.0;
  dive.params.start_sigma_m = 1.0;
  for (const std::size_t second : {60u, 80u}) dive.fixes.push_back(FixAt(dive, second, 3.0));
  const DeadReckoning two = Navigate(dive);
  EXPECT_GT(ErrorAt(dive, two, 120).position_m, 250.0);
  EXPECT_EQ(two.counters().count("fix_reset"), 0u);
  dive.fixes.push_back(FixAt(dive, 100, 3.0));
  const DeadReckoning three = Navigate(dive);
  EXPECT_LT(ErrorAt(dive, three, 120).position_m, 3.0);
  EXPECT_EQ(three.counters().at("fix_reset"), 1);
  EXPECT_EQ(three.counters().at("position_moved"), 1);
  EXPECT_NEAR(static_cast<double>(three.counters().at("position_moved_cm")), 30000.0, 300.0);
}

TEST(Recovery, FixesThatDisagreeOverruleNothing) {
  Dive dive = CleanDive();
  dive.params.fuse_position_fixes = true;
  for (const std::size_t second : {60u, 80u, 100u, 120u}) {
    PositionFix fix = FixAt(dive, second, 3.0);
    fix.latitude_rad += 1e-5 * static_cast<double>(second);  // 64 m a second
    dive.fixes.push_back(fix);
  }
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_LT(ErrorAt(dive, navigation, 140).position_m, 3.0);
  EXPECT_EQ(navigation.counters().at("fix_gated"), 4);
}

// Of two components one may be beyond the gate of a single one, where both together are not.
TEST(Recovery, AFixIsUsedWithBothComponentsOrNotAtAll) {
  Dive dive = CleanDive();
  dive.params.fuse_position_fixes = true;
  PositionFix fix = FixAt(dive, 60, 1.0);
  fix.latitude_rad += 4.6 / 6.38e6;
  fix.longitude_rad += 1.0 / (6.38e6 * std::cos(fix.latitude_rad));
  dive.fixes.push_back(fix);
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_EQ(navigation.innovations(NavSensor::kPositionFix).used, 2);
  EXPECT_EQ(navigation.innovations(NavSensor::kPositionFix).gated, 0);
}

// --- inertial data
// --------------------------------------------------------------------------------

TEST(Recovery, AGapOfInertialDataWithoutAnAttitudeAfterItIsBridged) {
  Dive dive = CleanDive();
  EndAttitude(&dive, 180.0);
  InertialGap(195.0, 2.0).apply(&dive);
  const DeadReckoning navigation = Navigate(dive);
  ASSERT_EQ(navigation.latest(), dive.imu.back().time);
  EXPECT_EQ(navigation.counters().at("imu_gap"), 1);
  // Between the gap and the next turn the heading stays, and tilt and velocity are found anew.
  const Error after = ErrorAt(dive, navigation, 210);
  EXPECT_LT(after.velocity_mps, 0.2);
  EXPECT_LT(after.heading_rad, 3.0 * after.heading_sigma_rad);
  EXPECT_LT(TiltErrorRad(dive, navigation, 260), Deg2Rad(0.5));
}

// Attitude sensors on NMEA 2000 send once a second.
TEST(Recovery, ASlowInertialUnitIsIntegratedWithTheDopplerLog) {
  const std::size_t last = CleanDive().truth.size() - 2;
  const double full_m = ErrorAt(CleanDive(), Navigate(CleanDive()), last).position_m;
  for (const double hz : {4.0, 2.0, 1.0}) {
    Dive dive = CleanDive();
    std::optional<Time> kept;
    std::erase_if(dive.imu, [&](const ImuSample& imu) {
      if (kept && ToSeconds(imu.time - *kept) < 1.0 / hz - 1e-3) return true;
      kept = imu.time;
      return false;
    });
    const DeadReckoning navigation = Navigate(dive);
    const std::size_t second = last - 2;
    EXPECT_LT(ErrorAt(dive, navigation, second).position_m,
              3.0 * PositionSigmaM(dive, navigation, second))
        << hz;
    EXPECT_LT(ErrorAt(dive, navigation, second).position_m, full_m + 3.0) << hz;
    Counters counters = navigation.counters();
    EXPECT_LE(counters["imu_gap"], 6) << hz;  // until its rate is known
  }
}

// The pose there is interpolated: by what the vehicle did meanwhile it may be wrong.
TEST(Recovery, PosesInsideAGapOfInertialDataAreAsUncertainAsTheGapIsLong) {
  Dive dive = CleanDive();
  InertialGap(195.0, 10.0).apply(&dive);
  const DeadReckoning navigation = Navigate(dive);
  const auto sigma_m = [&](std::size_t second) {
    const NavState state = navigation.StateAt(dive.truth.at(second).time).value();
    return std::sqrt(state.covariance.topLeftCorner<2, 2>().trace());
  };
  const auto relative_m = [&](std::size_t from, std::size_t to) {
    const auto covariance =
        navigation.RelativeCovariance(dive.truth.at(from).time, dive.truth.at(to).time);
    return std::sqrt(covariance.value().topLeftCorner<2, 2>().trace());
  };
  EXPECT_LT(sigma_m(194), 1.0);
  for (std::size_t second = 196; second < 205; ++second) {
    EXPECT_GT(sigma_m(second), sigma_m(second - 1));
    EXPECT_LT(ErrorAt(dive, navigation, second).position_m, 3.0 * sigma_m(second));
    EXPECT_NEAR(relative_m(190, second), std::sqrt(2.0) * static_cast<double>(second - 195), 0.6);
    // Chi-squared of three degrees of freedom: 1 in 370.
    EXPECT_LT(RelativeNees(dive.truth.at(190), dive.truth.at(second), navigation).value(), 14.2);
  }
  EXPECT_LT(relative_m(200, 200), 1e-6);
  EXPECT_NEAR(relative_m(199, 201), std::sqrt(2.0) * 2.0, 0.6);
  // After it nothing is added but what the gap itself left.
  EXPECT_LT(relative_m(210, 240), 1.0);
}

TEST(Recovery, FixesInsideAGapOfInertialDataGoToTheGraph) {
  Dive dive = CleanDive();
  InertialGap(195.0, 10.0).apply(&dive);
  // Without an attitude for the first two seconds after the gap.
  for (ImuSample& imu : dive.imu)
    if (const double t = ToSeconds(imu.time - dive.imu[0].time); t > 195.0 && t < 207.0)
      imu.attitude.reset();
  // One comes while the inertial unit is silent, one after that, one during the wait for attitude.
  const PositionFix early = FixAt(dive, 198, 1.0);
  for (const std::size_t second : {201u, 206u}) {
    dive.fixes.push_back(FixAt(dive, second, 1.0));
    dive.fixes.back().source = std::to_string(second);
  }
  DeadReckoning navigation(dive.params, dive.vehicle);
  Dive before = dive;
  std::erase_if(before.imu, [&](const ImuSample& imu) { return imu.time > early.time; });
  std::erase_if(before.dvl, [&](const DvlSample& dvl) { return dvl.time > early.time; });
  before.fixes.clear();
  FeedDive(before, &navigation);
  navigation.Add(early);
  std::erase_if(dive.imu, [&](const ImuSample& imu) { return imu.time <= early.time; });
  std::erase_if(dive.dvl, [&](const DvlSample& dvl) { return dvl.time <= early.time; });
  FeedDive(dive, &navigation);
  ASSERT_EQ(navigation.WaitingFixes().size(), 3u);
  EXPECT_EQ(navigation.WaitingFixes()[0].time, early.time);
  EXPECT_EQ(navigation.counters().count("fix_late"), 0u);
}

// The first attitude after the gap is 0.15 s old, and the vehicle turns by 20 deg/s.
TEST(Recovery, AGapThatEndsInATurnEndsWithTheHeadingOfItsEnd) {
  for (const double configured_s : {-0.15, 0.0}) {
    Dive dive = CleanDive();
    LateAttitude(0.15).apply(&dive);
    dive.params.attitude_time_offset_s = configured_s;
    InertialGap(205.0, 10.0).apply(&dive);
    const DeadReckoning navigation = Navigate(dive);
    EXPECT_LT(ErrorAt(dive, navigation, 216).heading_rad, Deg2Rad(1.2)) << configured_s;
  }
}

// The accelerometers integrate to more than the vehicle's largest speed, again and again.
TEST(Recovery, ALimitedSpeedDoesNotFeedItself) {
  Dive dive = CleanDive();
  LoseLock(&dive, 195.0, 1e9);
  for (ImuSample& imu : dive.imu)
    if (ToSeconds(imu.time - dive.imu[0].time) > 195.0) imu.specific_force_mps2.x() += 0.5;
  const DeadReckoning navigation = Navigate(dive);
  // One limit for every doubt of 5 s.
  EXPECT_GE(navigation.counters().at("speed_limited"), 5);
  EXPECT_LE(navigation.counters().at("speed_limited"), 100);
  EXPECT_LT(PositionSigmaM(dive, navigation, 590), 4000.0);
}

// --- gyros and attitude
// ---------------------------------------------------------------------------

TEST(Recovery, AFrozenAttitudeIsNotUsedUntilItChanges) {
  Dive dive = CleanDive();
  Stuck(StuckSensor::kAttitude, 195.0, 30.0).apply(&dive);
  const DeadReckoning navigation = Navigate(dive);
  // The vehicle rolls by 3 degrees and is back in the frozen attitude every few seconds.
  EXPECT_GT(navigation.counters().at("attitude_frozen"), 280);
  EXPECT_LT(ErrorAt(dive, navigation, 224).heading_rad, Deg2Rad(1.0));
}

// On a straight line all three rates repeat for seconds.
TEST(Recovery, GyrosWithCoarseStepsAreNotStuck) {
  Dive dive;
  dive.params.gyro_step_radps = 0.01;
  dive.vehicle = TestVehicle();
  Motion motion;
  motion.roll_amplitude_rad = motion.pitch_amplitude_rad = Deg2Rad(0.1);
  motion.turns = {{60.0, 20.0, kPi / 2.0}};
  Sensors sensors(dive.params, 100.0, 1, 0.0);
  int repeated = 0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  DeadReckoning navigation(dive.params, dive.vehicle);
  for (const TruthState& truth : Truth(motion, dive.vehicle, 120.0, 100.0)) {
    ImuSample imu = sensors.Imu(truth);
    imu.angular_rate_radps = 0.01 * (imu.angular_rate_radps / 0.01).array().round().matrix();
    if (imu.angular_rate_radps == last) ++repeated;
    last = imu.angular_rate_radps;
    navigation.Add(imu);
    if (repeated % 20 == 0) navigation.Add(sensors.Dvl(truth));
  }
  EXPECT_GT(repeated, 10000);
  EXPECT_EQ(navigation.counters().count("gyro_doubted"), 0u);
}

TEST(Recovery, GyrosThatAreStuckAreFoundBeforeTheyBendTheTrack) {
  Dive dive = CleanDive();
  Stuck(StuckSensor::kGyro, 195.0, 10.0).apply(&dive);
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_EQ(navigation.counters().at("gyro_doubted"), 1);
  for (std::size_t second = 197; second < 205; ++second)
    EXPECT_LT(ErrorAt(dive, navigation, second).heading_rad, Deg2Rad(1.5)) << second;
}

// Of the autopilot's state half a second ahead: stuck in a turn, the gyros go on turning.
TEST(Recovery, APredictionDoesNotTurnByGyrosInDoubt) {
  Dive dive = CleanDive();
  Stuck(StuckSensor::kGyro, 214.0, 30.0).apply(&dive);
  DeadReckoning navigation(dive.params, dive.vehicle);
  std::size_t dvl = 0;
  std::size_t second = 0;
  for (const ImuSample& imu : dive.imu) {
    navigation.Add(imu);
    for (; dvl < dive.dvl.size() && dive.dvl[dvl].time <= imu.time; ++dvl)
      navigation.Add(dive.dvl[dvl]);
    if (second > 240 || dive.truth[second].time > imu.time) continue;
    const TruthSample& truth = dive.truth[second++];
    if (second < 228) continue;
    const NavState state = navigation.Predicted().value();
    const double off_rad = WrapAngle(RpyFromRotation(state.T_map_vehicle.linear()).z() -
                                     RpyFromRotation(truth.T_map_vehicle.linear()).z());
    EXPECT_LT(std::abs(off_rad), Deg2Rad(3.0)) << second;
    EXPECT_GT(std::sqrt(state.covariance(5, 5)), 0.04) << second;
  }
  EXPECT_EQ(navigation.counters().at("gyro_doubted"), 1);
}

// --- hindsight
// -------------------------------------------------------------------------------------

// It goes on from the last call where it can. What was asked before changes no bit.
TEST(Recovery, HindsightIsTheSameHoweverItWasAskedBefore) {
  const Dive dive = SimulatedDive(1, 120.0, 50.0);
  const DeadReckoning asked = Navigate(dive);
  for (std::size_t second = 20; second < 110; ++second)
    for (const std::size_t anchor : {5u, 9u, 12u, 14u, 17u})
      if (second % (anchor - 3) != 0) {
        ASSERT_TRUE(asked.Hindsight(dive.truth[anchor].time, dive.truth[second].time).has_value());
      }
  for (const std::size_t anchor : {17u, 5u, 12u}) {
    const Time from = dive.truth[anchor].time;
    for (const std::size_t second : {109u, 60u, 61u, 18u}) {
      const Time to = dive.truth[second].time + FromSeconds(0.55);
      const DeadReckoning fresh = Navigate(dive);
      EXPECT_TRUE(asked.Hindsight(from, to)->Vector() == fresh.Hindsight(from, to)->Vector());
    }
  }
}

// --- DVL
// ------------------------------------------------------------------------------------------

// Fish, then no lock, then right data.
TEST(Recovery, AStepOfTheDopplerLogEndsWithItsLock) {
  Dive dive = CleanDive();
  ShiftDvl(&dive, 60.0, 65.0, 0.6);
  LoseLock(&dive, 65.0, 125.0);
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_LT(PositionSigmaM(dive, navigation, 590), PositionSigmaM(dive, navigation, 140) + 5.0);
  EXPECT_LT(ErrorAt(dive, navigation, 590).velocity_mps, 0.1);
}

// It steps back while the lock flickers, where the comparison with the accelerometers does not see
// it.
TEST(Recovery, ADopplerLogIsTakenBackAlsoWhereAStepOfItWasFollowed) {
  Dive dive = CleanDive();
  ShiftDvl(&dive, 60.0, 400.0, 0.6);
  LoseLock(&dive, 400.0, 404.0);
  const DeadReckoning navigation = Navigate(dive);
  EXPECT_GT(ErrorAt(dive, navigation, 399).velocity_mps, 0.5);
  EXPECT_LT(ErrorAt(dive, navigation, 420).velocity_mps, 0.1);
}

TEST(Recovery, ADopplerLogThatIsFasterThanTheVehicleIsNotFollowed) {
  Dive dive = CleanDive();
  for (DvlSample& dvl : dive.dvl) {
    const double t = ToSeconds(dvl.time - dive.imu[0].time);
    if (t > 195.0 && t < 215.0) dvl.v_dvl_mps *= 5.0;  // 7.5 m/s
  }
  const FilterScore score = ScoreFilter(dive, 215.0);
  EXPECT_EQ(score.counters.at("dvl_too_fast"), 99);
  EXPECT_LE(score.largest_speed_mps, 2.0);
  EXPECT_LT(score.largest_m, 2.0);
}

TEST(Recovery, ADiveDoesNotStartWithAVelocityThatCannotBe) {
  Dive dive = CleanDive();
  for (DvlSample& dvl : dive.dvl)
    if (ToSeconds(dvl.time - dive.imu[0].time) < 5.0) dvl.v_dvl_mps *= 5.0;
  const FilterScore score = ScoreFilter(dive, 5.0);
  EXPECT_LE(score.largest_speed_mps, 3.0);
  EXPECT_LT(score.largest_m, 3.0);
}

TEST(Recovery, ParametersThatNoFilterCanWorkWithAreNamed) {
  NavigationParams params;
  params.dvl_scale.sigma = std::nan("");
  try {
    const DeadReckoning navigation(params, TestVehicle());
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_STREQ(e.what(), "navigation.dvl_scale = nan, must be above 0");
  }
}

}  // namespace
}  // namespace seastitch::test
