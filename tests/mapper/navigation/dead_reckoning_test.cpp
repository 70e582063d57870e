#include "mapper/navigation/dead_reckoning.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "tests/mapper/navigation/survey_motion.hpp"

namespace seastitch {
namespace {

using test::At;
using test::ClosedSquare;
using test::Feed;
using test::LawnMower;
using test::Motion;
using test::RunOptions;
using test::Sensors;
using test::TestVehicle;
using test::Truth;
using test::TruthState;

constexpr double kImuHz = 50.0;

std::size_t Index(double t) { return static_cast<std::size_t>(std::lround(t * kImuHz)); }

// From the start of the estimate, which begins wherever the first sample was.
Eigen::Vector3d MovedError(const DeadReckoning& navigation,
                           const std::vector<TruthState>& truth,
                           double from_s,
                           double to_s) {
  const auto a = navigation.StateAt(At(from_s));
  const auto b = navigation.StateAt(At(to_s));
  return (b->T_map_vehicle.translation() - a->T_map_vehicle.translation()) -
         (truth[Index(to_s)].T_map_vehicle.translation() -
          truth[Index(from_s)].T_map_vehicle.translation());
}

TEST(DeadReckoning, ReturnsToStartOnAClosedSquare) {
  const auto truth = Truth(ClosedSquare(60.0), TestVehicle(), 241.0, kImuHz);
  NavigationParams params;
  Sensors perfect(params, kImuHz, 1, 0.0);
  DeadReckoning navigation(params, TestVehicle());
  Feed(truth, {}, &perfect, &navigation);
  const Eigen::Vector3d moved = truth[Index(241.0)].T_map_vehicle.translation() -
                                truth[Index(1.0)].T_map_vehicle.translation();
  ASSERT_LT(moved.head<2>().norm(), 0.1);  // the truth itself closes
  EXPECT_LT(MovedError(navigation, truth, 1.0, 241.0).norm(), 0.02);
  EXPECT_LT(MovedError(navigation, truth, 1.0, 100.0).norm(), 0.02);
  EXPECT_EQ(navigation.innovations(NavSensor::kDvl).gated, 0);
}

TEST(DeadReckoning, DriftsAsItsHeadingBiasAndDvlScaleSay) {
  Motion straight;  // and even: motion in heave and pitch would show the scale
  straight.roll_amplitude_rad = straight.pitch_amplitude_rad = straight.heave_amplitude_m = 0.0;
  const auto truth = Truth(straight, TestVehicle(), 400.0, kImuHz);
  NavigationParams params;
  Sensors sensors(params, kImuHz, 1, 0.0);
  sensors.attitude_bias_rad = {0.0, 0.0, Deg2Rad(0.5)};
  sensors.dvl_scale = 0.004;
  DeadReckoning navigation(params, TestVehicle());
  Feed(truth, {}, &sensors, &navigation);
  const Eigen::Vector3d error = MovedError(navigation, truth, 10.0, 400.0);
  const double distance_m = 390.0 * straight.speed_mps;
  EXPECT_NEAR(error.x(), 0.004 * distance_m, 0.05 * 0.004 * distance_m);
  EXPECT_NEAR(error.y(), Deg2Rad(0.5) * distance_m, 0.05 * Deg2Rad(0.5) * distance_m);
  EXPECT_NEAR(error.z(), 0.0, 0.05);
  // And it knows that this may be so.
  const auto state = navigation.StateAt(At(400.0));
  EXPECT_NEAR(std::sqrt(state->covariance(0, 0)), params.dvl_scale.sigma * distance_m, 1.0);
  EXPECT_GT(std::sqrt(state->covariance(1, 1)), Deg2Rad(0.35) * distance_m);
  EXPECT_LT(std::sqrt(state->covariance(1, 1)), Deg2Rad(0.60) * distance_m);
}

TEST(DeadReckoning, DoesNotAverageTheHeadingBiasAway) {
  const auto truth = Truth(Motion{}, TestVehicle(), 600.0, kImuHz);
  NavigationParams params;
  Sensors sensors(params, kImuHz, 7);
  DeadReckoning navigation(params, TestVehicle());
  Feed(truth, {}, &sensors, &navigation);
  const auto state = navigation.StateAt(At(600.0));
  EXPECT_GT(std::sqrt(state->covariance(5, 5)), 0.8 * params.attitude_heading_rad.sigma);
  EXPECT_LT(std::sqrt(state->covariance(5, 5)), 1.1 * params.attitude_heading_rad.sigma);
}

// Half the sum of the errors, along the track, of two dives whose sensors err by the same amounts
// with opposite signs: what is left is of second order.
double MeanErrorOfOppositeDives(const std::vector<TruthState>& truth,
                                const NavigationParams& sensors,
                                const NavigationParams& configured,
                                std::uint32_t seed) {
  double sum_m = 0.0;
  for (const double sign : {1.0, -1.0}) {
    Sensors drawn(sensors, kImuHz, seed, sign);
    DeadReckoning navigation(configured, TestVehicle());
    RunOptions options;
    options.dvl_every = 10;
    Feed(truth, options, &drawn, &navigation);
    sum_m += MovedError(navigation, truth, 1.0, truth.back().t).x();
  }
  return 0.5 * sum_m;
}

// Noise in the velocity by which the filter learns the DVL's scale, times noise in the innovation
// from which it does, has a mean: taken for scale, 1.5e-3 of this track with the figures of the
// sensors, 0.45e-3 with three times as much of every noise.
TEST(DeadReckoning, TakesNoNoiseForDvlScale) {
  constexpr double kEndS = 600.0;
  constexpr std::uint32_t kPairs = 4;
  const Motion straight;
  const auto truth = Truth(straight, TestVehicle(), kEndS, kImuHz);
  NavigationParams sensors;
  sensors.dvl_scale.sigma = 5e-3;
  sensors.attitude_heading_rad.sigma = Deg2Rad(0.01);  // a heading error, too, shortens the track
  NavigationParams careful = sensors;
  careful.accel_noise_mps2_rthz *= 3.0;
  careful.accel_bias_mps2.sigma *= 3.0;
  careful.attitude_roll_pitch_rad.sigma *= 3.0;
  careful.dvl_sigma_floor_mps = 3.0 * sensors.dvl_sigma_mps;
  careful.depth_sigma_floor_m = 3.0 * sensors.depth_sigma_m;
  for (const NavigationParams& configured : {sensors, careful}) {
    double sum_m = 0.0;
    for (std::uint32_t seed = 0; seed < kPairs; ++seed)
      sum_m += MeanErrorOfOppositeDives(truth, sensors, configured, seed);
    // The mean of four pairs scatters by 0.04e-3 of the distance.
    EXPECT_NEAR(sum_m / kPairs / (straight.speed_mps * kEndS), 0.0, 0.2e-3);
  }
}

TEST(DeadReckoning, TakesTheDevicesOwnSigmaWhereItIsLarger) {
  const auto truth = Truth(Motion{}, TestVehicle(), 5.0, kImuHz);
  NavigationParams params;
  DeadReckoning navigation(params, TestVehicle());
  Sensors sensors(params, kImuHz, 7);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    ImuSample imu = sensors.Imu(truth[i]);
    imu.attitude->sigma_rpy_rad = {0.001, 0.001, Deg2Rad(3.0)};
    navigation.Add(imu);
    navigation.Add(sensors.Dvl(truth[i]));
    navigation.Add(sensors.Depth(truth[i]));
  }
  navigation.Finish();
  const auto state = navigation.StateAt(At(5.0));
  EXPECT_NEAR(std::sqrt(state->covariance(5, 5)), Deg2Rad(3.0), Deg2Rad(0.2));
}

// --- honesty ---------------------------------------------------------------------------------

// Sum over runs of error^T covariance^-1 error, which is chi-square with runs * dof.
struct Nees {
  double sum = 0.0;
  template <class V, class M>
  void Add(const V& error, const M& covariance) {
    sum += error.dot(covariance.llt().solve(error));
  }
};

// The central 95 % of chi-square with n degrees of freedom (Wilson and Hilferty).
std::pair<double, double> Band95(double n) {
  const auto quantile = [n](double z) {
    const double c = 2.0 / (9.0 * n);
    return n * std::pow(1.0 - c + z * std::sqrt(c), 3);
  };
  return {quantile(-1.96), quantile(1.96)};
}

// Thirty dives over the same ground, each with its own draw of every error that params state.
class MonteCarlo : public testing::Test {
 protected:
  static constexpr int kRuns = 30;
  static constexpr double kDurationS = 420.0;
  static constexpr std::array<double, 3> kTimesS{60.0, 200.0, 420.0};
  // Frames of submaps: neighbours on a leg, across a turn, far apart; none on a whole second.
  static constexpr std::array<std::array<double, 2>, 4> kPairsS{
      {{30.13, 75.51}, {75.51, 150.27}, {30.13, 400.77}, {250.0, 330.0}}};

  struct Result {
    std::array<Nees, kTimesS.size()> position;
    std::array<Nees, kTimesS.size()> attitude;
    std::array<Nees, kPairsS.size()> relative;
    std::array<Eigen::Matrix3d, kPairsS.size()> scatter;   // mean of error error^T
    std::array<Eigen::Matrix3d, kPairsS.size()> expected;  // mean covariance
    std::int64_t gated = 0;
    std::int64_t used = 0;
  };
  static void ExpectInBand(const Nees& nees, int dof, const std::string& what) {
    const auto [low, high] = Band95(kRuns * dof);
    EXPECT_GT(nees.sum, low) << what;
    EXPECT_LT(nees.sum, high) << what;
    RecordProperty(what, std::to_string(nees.sum / (kRuns * dof)));
  }

  static Result Run() {
    const VehicleGeometry vehicle = TestVehicle();
    const auto truth = Truth(LawnMower(120.0, 4), vehicle, kDurationS, kImuHz);
    Result result;
    result.scatter.fill(Eigen::Matrix3d::Zero());
    result.expected.fill(Eigen::Matrix3d::Zero());
    for (std::uint32_t run = 0; run < kRuns; ++run) AddRun(truth, vehicle, run, &result);
    return result;
  }

 private:
  static void AddRun(const std::vector<TruthState>& truth,
                     const VehicleGeometry& vehicle,
                     std::uint32_t run,
                     Result* result) {
    NavigationParams params;
    params.start_sigma_m = 0.5;
    std::mt19937 random(1000 + run);
    std::normal_distribution<double> normal(0.0, params.start_sigma_m);
    params.start_north_m = normal(random);
    params.start_east_m = normal(random);
    Sensors sensors(params, kImuHz, run);
    DeadReckoning navigation(params, vehicle);
    Feed(truth, {}, &sensors, &navigation);
    // The start is known as of the first state, not as of the first sample.
    const double start_s = FirstState(navigation, truth);
    const Eigen::Vector3d moved_before_start =
        truth[Index(start_s)].T_map_vehicle.translation() - truth[0].T_map_vehicle.translation();

    for (std::size_t i = 0; i < kTimesS.size(); ++i) {
      const TruthState& at = truth[Index(kTimesS[i])];
      const NavState state = *navigation.StateAt(At(kTimesS[i]));
      Eigen::Vector3d p_error = state.T_map_vehicle.translation() - at.T_map_vehicle.translation();
      p_error.head<2>() += moved_before_start.head<2>();
      result->position[i].Add(p_error, state.covariance.topLeftCorner<3, 3>());
      Eigen::Vector3d rpy_error = RpyFromRotation(state.T_map_vehicle.linear()) -
                                  RpyFromRotation(at.T_map_vehicle.linear());
      rpy_error.z() = WrapAngle(rpy_error.z());
      result->attitude[i].Add(rpy_error, state.covariance.bottomRightCorner<3, 3>());
    }
    for (std::size_t i = 0; i < kPairsS.size(); ++i) AddPair(navigation, i, result);
    const InnovationSummary dvl = navigation.innovations(NavSensor::kDvl);
    result->gated += dvl.gated;
    result->used += dvl.used;
  }

  static double FirstState(const DeadReckoning& navigation, const std::vector<TruthState>& truth) {
    for (const TruthState& state : truth)
      if (navigation.StateAt(At(state.t))) return state.t;
    return 0.0;
  }

  static Pose2 TruthAt(double t) {
    // Between IMU samples the truth is asked for its own track, at a rate of its own.
    static const auto fine = Truth(LawnMower(120.0, 4), TestVehicle(), kDurationS, 100.0);
    return LevelPose(fine[static_cast<std::size_t>(std::lround(t * 100.0))].T_map_vehicle);
  }

  static void AddPair(const DeadReckoning& navigation, std::size_t i, Result* result) {
    const Time a = At(kPairsS[i][0]);
    const Time b = At(kPairsS[i][1]);
    const Pose2 estimated = Inverse(LevelPose(navigation.StateAt(a)->T_map_vehicle)) *
                            LevelPose(navigation.StateAt(b)->T_map_vehicle);
    const Pose2 truth = Inverse(TruthAt(kPairsS[i][0])) * TruthAt(kPairsS[i][1]);
    Eigen::Vector3d error = estimated.Vector() - truth.Vector();
    error.z() = WrapAngle(error.z());
    const Eigen::Matrix3d covariance = *navigation.RelativeCovariance(a, b);
    result->relative[i].Add(error, covariance);
    result->scatter[i] += error * error.transpose() / kRuns;
    result->expected[i] += covariance / kRuns;
  }
};

// One test, so that the thirty dives are made once.
TEST_F(MonteCarlo, ErrorsHaveTheCovarianceThatTheFilterStates) {
  const Result result = Run();
  for (std::size_t i = 0; i < kTimesS.size(); ++i) {
    const std::string at = " at " + std::to_string(kTimesS[i]) + " s";
    ExpectInBand(result.position[i], 3, "position" + at);
    ExpectInBand(result.attitude[i], 3, "attitude" + at);
  }
  const auto [low, high] = Band95(kRuns);
  for (std::size_t i = 0; i < kPairsS.size(); ++i) {
    const std::string pair = " of pair " + std::to_string(i);
    ExpectInBand(result.relative[i], 3, "relative pose" + pair);
    const Eigen::Vector3d ratio =
        result.scatter[i].diagonal().cwiseQuotient(result.expected[i].diagonal());
    for (int axis = 0; axis < 3; ++axis) {
      // Twelve at once: a little wider than the band of one.
      EXPECT_GT(ratio(axis), 0.8 * low / kRuns) << "axis " << axis << pair;
      EXPECT_LT(ratio(axis), 1.2 * high / kRuns) << "axis " << axis << pair;
    }
  }
  // 4 sigma: 6 in 100,000.
  EXPECT_LT(static_cast<double>(result.gated), 1e-3 * static_cast<double>(result.used));
}

TEST(RelativeCovariance, IsThatOfTheMotionAndNotOfTheStart) {
  const auto truth = Truth(Motion{}, TestVehicle(), 120.0, kImuHz);
  NavigationParams near;
  NavigationParams far;
  far.start_sigma_m = 1000.0;
  DeadReckoning a(near, TestVehicle());
  DeadReckoning b(far, TestVehicle());
  Sensors sensors_a(near, kImuHz, 3);
  Sensors sensors_b(near, kImuHz, 3);
  Feed(truth, {}, &sensors_a, &a);
  Feed(truth, {}, &sensors_b, &b);
  const Eigen::Matrix3d of_a = *a.RelativeCovariance(At(30.0), At(90.4));
  const Eigen::Matrix3d of_b = *b.RelativeCovariance(At(30.0), At(90.4));
  EXPECT_LT((of_a - of_b).norm(), 1e-3 * of_a.norm());
  EXPECT_LT(std::sqrt(of_a(0, 0)), 1.0);
}

TEST(RelativeCovariance, IsNothingBetweenATimeAndItselfAndTheInverseTheOtherWayRound) {
  const auto truth = Truth(ClosedSquare(60.0), TestVehicle(), 240.0, kImuHz);
  NavigationParams params;
  DeadReckoning navigation(params, TestVehicle());
  Sensors sensors(params, kImuHz, 3);
  Feed(truth, {}, &sensors, &navigation);
  EXPECT_LT(navigation.RelativeCovariance(At(77.3), At(77.3))->norm(), 1e-12);

  const Time a = At(20.3);
  const Time b = At(150.8);
  const Pose2 T_a_b = Inverse(LevelPose(navigation.StateAt(a)->T_map_vehicle)) *
                      LevelPose(navigation.StateAt(b)->T_map_vehicle);
  const Eigen::Matrix3d forward = *navigation.RelativeCovariance(a, b);
  const Eigen::Matrix3d backward = *navigation.RelativeCovariance(b, a);
  // Of the inverse pose: RelativeCovariance of T_r_a = identity, exactly known.
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d inverted =
      seastitch::RelativeCovariance(T_a_b, Pose2{}, forward, zero, zero);
  EXPECT_LT((inverted - backward).norm(), 1e-6 * backward.norm());
}

TEST(RelativeCovariance, HasNoneOutsideTheWindow) {
  const auto truth = Truth(Motion{}, TestVehicle(), 60.0, kImuHz);
  NavigationParams params;
  params.pose_window_s = 5.0;
  params.window_s = 20.0;
  DeadReckoning navigation(params, TestVehicle());
  Sensors sensors(params, kImuHz, 3);
  Feed(truth, {}, &sensors, &navigation);
  EXPECT_FALSE(navigation.RelativeCovariance(At(10.0), At(59.0)));
  EXPECT_TRUE(navigation.RelativeCovariance(At(45.0), At(59.0)));
  EXPECT_FALSE(navigation.RelativeCovariance(At(45.0), At(60.1)));
  EXPECT_FALSE(navigation.StateAt(At(10.0)));
  EXPECT_TRUE(navigation.StateAt(At(45.0)));
  EXPECT_FALSE(navigation.StateAt(At(60.1)));
}

// --- loss of bottom lock -----------------------------------------------------------------------

struct Outage {
  double duration_s;
  // Until a pose is worth what it was before. After a long outage the filter learns for a while
  // from the DVL what its accelerometers did to it meanwhile, and mends its place: poses frozen
  // before that are as doubtful as it says.
  double settled_s;
  double max_sigma_m;  // neither wild nor so doubtful that the covariance would say nothing
};

class LossOfBottomLock : public testing::TestWithParam<Outage> {};

TEST_P(LossOfBottomLock, StaysWithinThreeSigmaSaysSoAndRecovers) {
  constexpr double kFromS = 120.0;
  const double to_s = kFromS + GetParam().duration_s;
  const double last_s = to_s - 0.5;
  const auto truth = Truth(Motion{}, TestVehicle(), to_s + 70.0, kImuHz);
  NavigationParams params;
  double worst_sigmas = 0.0;
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    Sensors sensors(params, kImuHz, seed);
    DeadReckoning navigation(params, TestVehicle());
    RunOptions options;
    options.outage_from_s = kFromS;
    options.outage_to_s = to_s;
    Feed(truth, options, &sensors, &navigation);
    EXPECT_TRUE(navigation.StateAt(At(119.0))->bottom_lock);
    EXPECT_FALSE(navigation.StateAt(At(to_s - 1.0))->bottom_lock);
    EXPECT_TRUE(navigation.StateAt(At(to_s + 2.0))->bottom_lock);
    const Eigen::Matrix3d before = *navigation.RelativeCovariance(At(89.0), At(119.0));
    const Eigen::Matrix3d during = *navigation.RelativeCovariance(At(119.0), At(last_s));
    const double from_s = to_s + GetParam().settled_s;
    const Eigen::Matrix3d after = *navigation.RelativeCovariance(At(from_s), At(from_s + 30.0));
    EXPECT_GT(during(0, 0), before(0, 0) * GetParam().duration_s / 30.0);
    EXPECT_LT(after(0, 0), 2.0 * before(0, 0));
    const Pose2 estimated = Inverse(LevelPose(navigation.StateAt(At(119.0))->T_map_vehicle)) *
                            LevelPose(navigation.StateAt(At(last_s))->T_map_vehicle);
    const Pose2 true_pose = Inverse(LevelPose(truth[Index(119.0)].T_map_vehicle)) *
                            LevelPose(truth[Index(last_s)].T_map_vehicle);
    const Eigen::Vector3d error = estimated.Vector() - true_pose.Vector();
    for (int i = 0; i < 2; ++i) {
      const double sigma = std::sqrt(during(i, i));
      worst_sigmas = std::max(worst_sigmas, std::abs(error(i)) / sigma);
      EXPECT_LT(std::abs(error(i)), 3.0 * sigma) << "seed " << seed;
      EXPECT_LT(sigma, GetParam().max_sigma_m);
    }
    const Eigen::Vector3d v_error =
        navigation.StateAt(At(to_s + 5.0))->v_map_mps - truth[Index(to_s + 5.0)].v_map_mps;
    EXPECT_LT(v_error.norm(), 0.05);
    EXPECT_EQ(navigation.counters().at("dvl_without_bottom_lock"),
              static_cast<int>(2.5 * GetParam().duration_s));
  }
  RecordProperty("worst_sigmas", std::to_string(worst_sigmas));
}

INSTANTIATE_TEST_SUITE_P(
    OfSeconds,
    LossOfBottomLock,
    testing::Values(Outage{10.0, 5.0, 0.5}, Outage{30.0, 5.0, 2.0}, Outage{60.0, 30.0, 8.0}),
    [](const auto& test) { return std::to_string(static_cast<int>(test.param.duration_s)); });

// --- sound speed at the DVL --------------------------------------------------------------------

// An instrument that reckons with 1500 m/s in water of 1470: its velocities are 2 % too large.
TEST(DeadReckoning, SetsTheDvlRightByTheSonarsSoundSpeed) {
  const auto truth = Truth(Motion{}, TestVehicle(), 120.0, kImuHz);
  NavigationParams params;
  params.dvl_sound_speed_mps = 1500.0;
  params.dvl_scale.sigma = 1e-4;
  const auto error_m = [&](double told_mps) {
    Sensors sensors(params, kImuHz, 1, 0.0);
    sensors.dvl_scale = 1500.0 / 1470.0 - 1.0;
    DeadReckoning navigation(params, TestVehicle());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      navigation.Add(sensors.Imu(truth[i]));
      if (i % 10 == 0) navigation.Add(sensors.Depth(truth[i]));
      if (i % 50 == 0) navigation.AddSoundSpeed(At(truth[i].t), told_mps);
      if (i % 20 == 0) navigation.Add(sensors.Dvl(truth[i]));
    }
    navigation.Finish();
    const auto refused = navigation.counters().find("sound_speed_refused");
    EXPECT_EQ(refused != navigation.counters().end(), told_mps == 0.0);
    return MovedError(navigation, truth, 10.0, 120.0).norm();
  };
  EXPECT_LT(error_m(1470.0), 0.05);
  EXPECT_GT(error_m(0.0), 0.015 * 110.0 * Motion{}.speed_mps);
}

TEST(DeadReckoning, RefusesAnEnsembleWithAWildComponent) {
  const auto truth = Truth(Motion{}, TestVehicle(), 100.0, kImuHz);
  NavigationParams params;
  Sensors clean_sensors(params, kImuHz, 5);
  Sensors sensors(params, kImuHz, 5);
  DeadReckoning clean(params, TestVehicle());
  DeadReckoning navigation(params, TestVehicle());
  Feed(truth, {}, &clean_sensors, &clean);
  int wild = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    navigation.Add(sensors.Imu(truth[i]));
    if (i % 10 == 0) navigation.Add(sensors.Depth(truth[i]));
    if (i % 20 != 0) continue;
    DvlSample dvl = sensors.Dvl(truth[i]);
    if (truth[i].t > 50.0 && i % 100 == 0) {
      dvl.v_dvl_mps.y() += 0.8;
      ++wild;
    }
    navigation.Add(dvl);
  }
  navigation.Finish();
  EXPECT_EQ(navigation.innovations(NavSensor::kDvl).gated,
            clean.innovations(NavSensor::kDvl).gated + wild);
  EXPECT_EQ(navigation.counters().at("dvl_axis_gated"), wild);
  EXPECT_LT((navigation.StateAt(At(100.0))->T_map_vehicle.translation() -
             clean.StateAt(At(100.0))->T_map_vehicle.translation())
                .norm(),
            0.1);
}

// Five minutes long: shorter ones are taken for a bottom that is none while the filter knows
// better.
TEST(DeadReckoning, BelievesADvlThatWillNotBeRefused) {
  const auto truth = Truth(Motion{}, TestVehicle(), 400.0, kImuHz);
  NavigationParams params;
  Sensors sensors(params, kImuHz, 5, 0.0);
  DeadReckoning navigation(params, TestVehicle());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    navigation.Add(sensors.Imu(truth[i]));
    if (i % 10 == 0) navigation.Add(sensors.Depth(truth[i]));
    if (i % 20 != 0) continue;
    DvlSample dvl = sensors.Dvl(truth[i]);
    if (truth[i].t > 60.0) dvl.v_dvl_mps.x() += 1.0;
    navigation.Add(dvl);
  }
  navigation.Finish();
  EXPECT_GE(navigation.counters().at("dvl_reset"), 1);
  EXPECT_TRUE(navigation.StateAt(At(400.0))->bottom_lock);
}

// --- order and hostility -----------------------------------------------------------------------

struct Stream {
  std::vector<ImuSample> imu;
  std::vector<DvlSample> dvl;
  std::vector<DepthSample> depth;
};

Stream MakeStream(double duration_s, const NavigationParams& params) {
  const auto truth = Truth(Motion{}, TestVehicle(), duration_s, kImuHz);
  Sensors sensors(params, kImuHz, 11);
  Stream stream;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    stream.imu.push_back(sensors.Imu(truth[i]));
    if (i % 10 == 0) stream.depth.push_back(sensors.Depth(truth[i]));
    if (i % 20 == 0) stream.dvl.push_back(sensors.Dvl(truth[i]));
  }
  return stream;
}

// Everything in the order of time + delay(sensor, its number).
template <class Delay>
void Deliver(const Stream& stream, const Delay& delay_s, DeadReckoning* navigation) {
  struct Arrival {
    Time at;
    int kind;
    std::size_t i;
  };
  std::vector<Arrival> arrivals;
  const auto add = [&](int kind, const auto& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      arrivals.push_back({samples[i].time + FromSeconds(delay_s(kind, i)), kind, i});
  };
  add(0, stream.imu);
  add(1, stream.dvl);
  add(2, stream.depth);
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) {
    return a.at < b.at;
  });
  for (const Arrival& arrival : arrivals) {
    if (arrival.kind == 0) navigation->Add(stream.imu[arrival.i]);
    if (arrival.kind == 1) navigation->Add(stream.dvl[arrival.i]);
    if (arrival.kind == 2) navigation->Add(stream.depth[arrival.i]);
  }
  navigation->Finish();
}

TEST(DeadReckoning, OrderWithinTheWindowDoesNotMatterToTheLastBit) {
  NavigationParams params;
  const Stream stream = MakeStream(40.0, params);
  DeadReckoning in_order(params, TestVehicle());
  DeadReckoning shuffled(params, TestVehicle());
  // The first inertial sample stays first: aiding before it has nothing to be placed by.
  Deliver(
      stream, [](int kind, std::size_t i) { return kind == 0 && i == 0 ? 0.0 : 0.01; }, &in_order);
  Deliver(
      stream,
      [](int kind, std::size_t i) {
        if (kind == 0 && i == 0) return 0.0;
        return 0.01 + 0.05 * static_cast<double>((i * 7919 + static_cast<std::size_t>(kind)) % 8);
      },
      &shuffled);
  EXPECT_EQ(shuffled.counters(), in_order.counters());
  for (double t = 5.0; t < 39.9; t += 0.777) {
    const NavState a = *in_order.StateAt(At(t));
    const NavState b = *shuffled.StateAt(At(t));
    EXPECT_TRUE(a.T_map_vehicle.matrix() == b.T_map_vehicle.matrix()) << t;
    EXPECT_TRUE(a.covariance == b.covariance) << t;
  }
  EXPECT_TRUE(*in_order.RelativeCovariance(At(10.0), At(35.0)) ==
              *shuffled.RelativeCovariance(At(10.0), At(35.0)));
}

TEST(DeadReckoning, CountsWhatComesAfterTheWindowAndStandsAsWithoutIt) {
  NavigationParams params;
  const Stream stream = MakeStream(20.0, params);
  Stream without = stream;
  without.dvl.erase(without.dvl.begin() + 20);
  DeadReckoning late(params, TestVehicle());
  DeadReckoning absent(params, TestVehicle());
  Deliver(
      stream, [](int kind, std::size_t i) { return kind == 1 && i == 20 ? 3.0 : 0.0; }, &late);
  Deliver(
      without, [](int, std::size_t) { return 0.0; }, &absent);
  EXPECT_EQ(late.counters().at("dvl_late"), 1);
  EXPECT_TRUE(late.StateAt(At(20.0))->T_map_vehicle.matrix() ==
              absent.StateAt(At(20.0))->T_map_vehicle.matrix());
}

// Everything that a broken device, bus or clock may say, in the middle of a good dive.
TEST(DeadReckoning, HostileSamplesAreCountedAndLeaveNoTrace) {
  NavigationParams params;
  const Stream stream = MakeStream(30.0, params);
  DeadReckoning clean(params, TestVehicle());
  DeadReckoning attacked(params, TestVehicle());
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &clean);

  const std::array<double, 4> bad{std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity(),
                                  1e30,
                                  -1e30};
  std::size_t dvl = 0;
  std::size_t depth = 0;
  for (std::size_t i = 0; i < stream.imu.size(); ++i) {
    attacked.Add(stream.imu[i]);
    if (i % 10 == 0) attacked.Add(stream.depth[depth++]);
    if (i % 20 == 0) attacked.Add(stream.dvl[dvl++]);
    // Stamped between the good ones, so that only their content can have them refused.
    const Time between = stream.imu[i].time + FromSeconds(0.003);
    for (const double value : bad) {
      ImuSample imu = stream.imu[i];
      imu.time = between;
      imu.angular_rate_radps.y() = value;
      attacked.Add(imu);
      imu = stream.imu[i];
      imu.time = between;
      imu.specific_force_mps2.z() = value;
      attacked.Add(imu);
      DvlSample wild = stream.dvl[0];
      wild.time = between;
      wild.v_dvl_mps.x() = value;
      attacked.Add(wild);
      wild = stream.dvl[0];
      wild.time = between;
      wild.sigma_v_mps.x() = value;
      attacked.Add(wild);
      DepthSample deep;
      deep.time = between;
      deep.depth_m = value;
      attacked.Add(deep);
      PositionFix fix;
      fix.time = between;
      fix.latitude_rad = value;
      attacked.Add(fix);
      fix.latitude_rad = test::kLatitudeRad;
      fix.covariance_north_east_m2(0, 0) = value;
      attacked.Add(fix);
    }
    for (const double hours : {-1.0, 1.0, 1e5}) {
      ImuSample imu = stream.imu[i];
      imu.time += FromSeconds(hours * 3600.0);
      if (i > 50) attacked.Add(imu);
      DvlSample wild = stream.dvl[0];
      wild.time += FromSeconds(hours * 3600.0);
      if (i > 50) attacked.Add(wild);
    }
  }
  attacked.Finish();
  for (double t = 5.0; t <= 30.0; t += 0.91) {
    EXPECT_TRUE(attacked.StateAt(At(t))->T_map_vehicle.matrix() ==
                clean.StateAt(At(t))->T_map_vehicle.matrix())
        << t;
    EXPECT_TRUE(attacked.StateAt(At(t))->covariance == clean.StateAt(At(t))->covariance) << t;
  }
  EXPECT_GT(attacked.counters().at("imu_refused"), 8000);
  EXPECT_GT(attacked.counters().at("dvl_refused"), 8000);
  EXPECT_GT(attacked.counters().at("depth_refused"), 4000);
  EXPECT_GT(attacked.counters().at("fix_refused"), 8000);
  EXPECT_GT(attacked.counters().at("imu_late"), 1000);
  EXPECT_GT(attacked.counters().at("imu_ahead"), 1000);
  EXPECT_GT(attacked.counters().at("dvl_ahead"), 1000);
}

TEST(DeadReckoning, ABadAttitudeIsRefusedAndTheRatesBesideItUsed) {
  NavigationParams params;
  const Stream stream = MakeStream(20.0, params);
  DeadReckoning navigation(params, TestVehicle());
  Stream broken = stream;
  for (std::size_t i = 500; i < broken.imu.size(); ++i)
    broken.imu[i].attitude->q_ned_imu.coeffs().setConstant(
        i % 2 == 0 ? 0.0 : std::numeric_limits<double>::quiet_NaN());
  Deliver(
      broken, [](int, std::size_t) { return 0.0; }, &navigation);
  EXPECT_EQ(navigation.counters().at("attitude_refused"), 501);
  const auto state = navigation.StateAt(At(20.0));
  ASSERT_TRUE(state);
  EXPECT_TRUE(state->T_map_vehicle.matrix().allFinite());
}

TEST(DeadReckoning, CoastsOverAHoleInTheInertialDataAndSaysSo) {
  const auto truth = Truth(Motion{}, TestVehicle(), 140.0, kImuHz);
  NavigationParams params;
  Sensors sensors(params, kImuHz, 5);
  DeadReckoning navigation(params, TestVehicle());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i].t > 60.0 && truth[i].t < 80.0) continue;
    navigation.Add(sensors.Imu(truth[i]));
    if (i % 10 == 0) navigation.Add(sensors.Depth(truth[i]));
    if (i % 20 == 0) navigation.Add(sensors.Dvl(truth[i]));
  }
  navigation.Finish();
  EXPECT_EQ(navigation.counters().at("imu_gap"), 1);
  EXPECT_EQ(navigation.counters().at("clock_jump"), 1);
  const Eigen::Matrix3d across = *navigation.RelativeCovariance(At(55.0), At(90.0));
  const Eigen::Vector3d error = MovedError(navigation, truth, 55.0, 90.0);
  EXPECT_GT(std::sqrt(across(0, 0)), 10.0);
  EXPECT_LT(error.norm(), 3.0 * std::sqrt(across(0, 0)));
  EXPECT_LT(MovedError(navigation, truth, 95.0, 140.0).norm(), 1.5);
}

TEST(DeadReckoning, AWildFirstStampIsForgottenBeforeTheStart) {
  NavigationParams params;
  const Stream stream = MakeStream(20.0, params);
  DeadReckoning navigation(params, TestVehicle());
  ImuSample wild = stream.imu[0];
  wild.time += FromSeconds(3600.0);
  navigation.Add(wild);
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  EXPECT_EQ(navigation.counters().at("clock_jump"), 1);
  EXPECT_TRUE(navigation.StateAt(At(10.0)));
}

// --- start and fixes ---------------------------------------------------------------------------

TEST(DeadReckoning, StartsWithoutVelocityWhenTheBottomIsOutOfReach) {
  NavigationParams params;
  Stream stream = MakeStream(20.0, params);
  stream.dvl.clear();
  DeadReckoning navigation(params, TestVehicle());
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  EXPECT_EQ(navigation.counters().at("start_without_dvl"), 1);
  ASSERT_TRUE(navigation.StateAt(At(11.0)));
  EXPECT_FALSE(navigation.StateAt(At(9.0)));
  EXPECT_FALSE(navigation.StateAt(At(11.0))->bottom_lock);
  EXPECT_GT(navigation.StateAt(At(20.0))->covariance(0, 0), 100.0);
}

TEST(DeadReckoning, HasNoStateWithoutAnAttitude) {
  NavigationParams params;
  Stream stream = MakeStream(20.0, params);
  for (ImuSample& imu : stream.imu) imu.attitude.reset();
  DeadReckoning navigation(params, TestVehicle());
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  EXPECT_FALSE(navigation.latest());
  EXPECT_FALSE(navigation.StateAt(At(15.0)));
}

PositionFix FixAt(double t, double north_m, double east_m, double sigma_m) {
  PositionFix fix;
  fix.time = At(t);
  // Radii of curvature of WGS 84 at kLatitudeRad.
  const double s2 = std::pow(std::sin(test::kLatitudeRad), 2);
  const double w = std::sqrt(1.0 - 0.00669437999014 * s2);
  const double meridian_m = 6378137.0 * (1.0 - 0.00669437999014) / (w * w * w);
  const double prime_m = 6378137.0 / w;
  fix.latitude_rad = test::kLatitudeRad + north_m / meridian_m;
  fix.longitude_rad = 0.2 + east_m / (prime_m * std::cos(test::kLatitudeRad));
  fix.covariance_north_east_m2 = sigma_m * sigma_m * Eigen::Matrix2d::Identity();
  fix.source = "gps";
  return fix;
}

TEST(DeadReckoning, StartsAtTheFirstFixWhenToldTo) {
  NavigationParams params;
  params.start_at_first_fix = true;
  const Stream stream = MakeStream(20.0, params);
  DeadReckoning navigation(params, TestVehicle());
  navigation.Add(stream.imu[0]);
  navigation.Add(FixAt(5.0, 120.0, -40.0, 2.0));
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  EXPECT_FALSE(navigation.StateAt(At(4.9)));
  const auto state = navigation.StateAt(At(5.1));
  ASSERT_TRUE(state);
  EXPECT_NEAR(state->T_map_vehicle.translation().x(), 120.0, 0.2);
  EXPECT_NEAR(state->T_map_vehicle.translation().y(), -40.0, 0.1);
  EXPECT_NEAR(std::sqrt(state->covariance(0, 0)), 2.0, 0.1);
}

// An antenna 2 m ahead of the reference point, 1 m to starboard and 3 m up, on a vehicle that
// turns.
TEST(DeadReckoning, FixesAreOfTheAntennaAndGoToTheGraphAsOfTheVehicle) {
  NavigationParams params;
  params.start_at_first_fix = true;
  const Eigen::Vector3d antenna(2.0, 1.0, -3.0);
  VehicleGeometry vehicle = TestVehicle();
  vehicle.fix_points.push_back({"gps", antenna});
  const auto truth = Truth(Motion{}, TestVehicle(), 60.0, kImuHz);
  const Stream stream = MakeStream(60.0, params);
  const auto fix_at = [&](double t) {
    const Eigen::Vector3d p = truth[Index(t)].T_map_vehicle * antenna;
    return FixAt(t, p.x(), p.y(), 0.5);
  };
  DeadReckoning navigation(params, vehicle);
  navigation.Add(stream.imu[0]);
  navigation.Add(fix_at(1.0));
  std::size_t dvl = 0, depth = 0;
  for (const ImuSample& imu : stream.imu) {
    navigation.Add(imu);
    for (; dvl < stream.dvl.size() && stream.dvl[dvl].time <= imu.time; ++dvl)
      navigation.Add(stream.dvl[dvl]);
    for (; depth < stream.depth.size() && stream.depth[depth].time <= imu.time; ++depth)
      navigation.Add(stream.depth[depth]);
    if (imu.time == At(30.0)) navigation.Add(fix_at(30.0));
    if (imu.time == At(50.0)) navigation.Add(fix_at(45.0));  // late
  }
  navigation.Finish();
  const std::vector<MapFix> fixes = navigation.TakeFixes(*navigation.latest());
  ASSERT_EQ(fixes.size(), 2u);
  for (const MapFix& fix : fixes) {
    const Eigen::Vector3d p =
        truth[Index(ToSeconds(fix.time - At(0.0)))].T_map_vehicle.translation();
    EXPECT_LT((fix.north_east_m - p.head<2>()).norm(), 0.05);
  }
}

TEST(DeadReckoning, StartsWhereTheVehicleIsAndNotItsAntenna) {
  NavigationParams params;
  params.start_at_first_fix = true;
  VehicleGeometry vehicle = TestVehicle();
  vehicle.fix_points.push_back({"gps", {2.0, 1.0, -3.0}});
  const auto truth = Truth(Motion{}, TestVehicle(), 20.0, kImuHz);
  const Eigen::Isometry3d& then = truth[Index(5.0)].T_map_vehicle;
  const Eigen::Vector3d antenna = then * Eigen::Vector3d(2.0, 1.0, -3.0);
  const Stream stream = MakeStream(20.0, params);
  DeadReckoning navigation(params, vehicle);
  navigation.Add(stream.imu[0]);
  navigation.Add(FixAt(5.0, antenna.x(), antenna.y(), 0.5));
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  const auto state = navigation.StateAt(At(5.1));
  ASSERT_TRUE(state);
  EXPECT_LT((state->T_map_vehicle.translation() - then.translation()).head<2>().norm(), 0.3);
}

// Of 1 Hz GPS the median of each 10 s counts once: its noise is less, its covariance is not.
TEST(DeadReckoning, FixesOfOneSourceThatFollowEachOtherCountAsTheirMedian) {
  NavigationParams params;
  const Stream stream = MakeStream(60.0, params);
  DeadReckoning navigation(params, TestVehicle());
  Deliver(
      stream, [](int, std::size_t) { return 0.0; }, &navigation);
  const std::vector<double> noise_m{0.4, -0.3, 80.0, 0.1, -0.2};  // one is wild
  for (std::size_t i = 0; i < noise_m.size(); ++i) {
    const double t = 20.0 + static_cast<double>(i);
    const Eigen::Vector3d p = navigation.StateAt(At(t))->T_map_vehicle.translation();
    navigation.Add(FixAt(t, p.x() + noise_m[i], p.y() - noise_m[i], 0.5));
  }
  PositionFix other = FixAt(22.0, 0.0, 0.0, 10.0);  // blocks nobody
  other.source = "usbl";
  navigation.Add(other);
  navigation.Add(FixAt(23.5, 1000.0, 0.0, 0.1));  // far better: on its own
  const std::vector<MapFix> fixes = navigation.TakeFixes(At(59.0));
  ASSERT_EQ(fixes.size(), 3u);
  const Eigen::Vector3d p = navigation.StateAt(At(20.0))->T_map_vehicle.translation();
  EXPECT_NEAR(fixes[0].north_east_m.x() - p.x(), 0.1, 1e-3);
  EXPECT_NEAR(fixes[0].north_east_m.y() - p.y(), -0.1, 1e-3);
  EXPECT_DOUBLE_EQ(fixes[0].covariance_m2(0, 0), 0.25);
  EXPECT_EQ(navigation.counters().at("fix_thinned"), 4);
  // Taken is taken: another of the same 10 s changes nothing.
  navigation.Add(FixAt(25.0, 0.0, 0.0, 0.5));
  EXPECT_TRUE(navigation.TakeFixes(At(59.0)).empty());
  EXPECT_EQ(navigation.counters().at("fix_thinned"), 5);
}

TEST(DeadReckoning, AFixPullsAndAWildOneIsGated) {
  NavigationParams params;
  params.start_sigma_m = 10.0;
  params.fuse_position_fixes = true;
  const auto truth = Truth(Motion{}, TestVehicle(), 60.0, kImuHz);
  const Eigen::Vector3d p = truth[Index(40.0)].T_map_vehicle.translation();
  const Stream stream = MakeStream(60.0, params);
  const auto run = [&](double off_m) {
    DeadReckoning navigation(params, TestVehicle());
    navigation.Add(stream.imu[0]);
    Stream first = stream;
    first.imu.resize(Index(40.0) + 2);
    first.dvl.resize(90);
    first.depth.resize(180);
    for (const ImuSample& imu : first.imu) {
      navigation.Add(imu);
      for (const DvlSample& dvl : stream.dvl)
        if (dvl.time == imu.time) navigation.Add(dvl);
      for (const DepthSample& depth : stream.depth)
        if (depth.time == imu.time) navigation.Add(depth);
    }
    navigation.Add(FixAt(40.0, p.x() + off_m, p.y(), 0.5));
    navigation.Finish();
    const auto state = navigation.StateAt(At(40.02));
    return std::pair(state->T_map_vehicle.translation().x() - p.x(),
                     navigation.counters().contains("fix_gated"));
  };
  const auto [near_m, near_gated] = run(8.0);
  EXPECT_NEAR(near_m, 8.0, 0.2);
  EXPECT_FALSE(near_gated);
  const auto [far_m, far_gated] = run(300.0);
  EXPECT_NEAR(far_m, 0.0, 2.0);
  EXPECT_TRUE(far_gated);
}

// A compass that knows nothing of a declination of 7 degrees: 5 two years ago, and one more a year.
TEST(DeadReckoning, AMagneticHeadingBecomesATrueOne) {
  NavigationParams params;
  const Stream stream = MakeStream(30.0, params);
  Stream magnetic = stream;
  for (ImuSample& imu : magnetic.imu)
    if (imu.attitude)
      imu.attitude->q_ned_imu =
          Eigen::AngleAxisd(-Deg2Rad(7.0), Eigen::Vector3d::UnitZ()) * imu.attitude->q_ned_imu;
  const auto navigate = [](const NavigationParams& with, const Stream& samples) {
    DeadReckoning navigation(with, TestVehicle());
    Deliver(
        samples, [](int, std::size_t) { return 0.0; }, &navigation);
    return navigation.StateAt(At(25.0)).value();
  };
  const NavState expected = navigate(params, stream);
  params.declination_rad = Deg2Rad(5.0);
  params.declination_rad_per_year = Deg2Rad(1.0);
  params.declination_year = 1968.0 + ToSeconds(At(0.0).time_since_epoch()) / (365.2425 * 86400.0);
  const NavState state = navigate(params, magnetic);
  EXPECT_LT((state.T_map_vehicle.matrix() - expected.T_map_vehicle.matrix()).norm(), 1e-3);
  EXPECT_NEAR(
      ConvergenceLimitM(params, Deg2Rad(60.0)), params.attitude_heading_rad.sigma * 3.678e6, 1e3);
  params.attitude_heading_rad.sigma = Deg2Rad(0.4);
  EXPECT_NE(NorthSentence(params, Deg2Rad(-60.0)).find("beyond 25.7 km"), std::string::npos);
  EXPECT_NE(NorthSentence(params, 0.0).find("near the equator"), std::string::npos);
}

// --- the track ---------------------------------------------------------------------------------

TEST(DeadReckoning, RollAndPitchBetweenSamplesAreRightToAHundredthOfADegree) {
  Motion rolling;
  rolling.roll_amplitude_rad = Deg2Rad(8.0);
  const auto coarse = Truth(rolling, TestVehicle(), 60.0, kImuHz);
  const auto fine = Truth(rolling, TestVehicle(), 60.0, 1000.0);
  NavigationParams params;
  Sensors perfect(params, kImuHz, 1, 0.0);
  DeadReckoning navigation(params, TestVehicle());
  Feed(coarse, {}, &perfect, &navigation);
  double worst = 0.0;
  double worst_step_m = 0.0;
  for (std::size_t i = 20000; i < 59000; i += 3) {
    const auto state = navigation.StateAt(At(fine[i].t));
    const Eigen::Vector3d error = RpyFromRotation(state->T_map_vehicle.linear()) -
                                  RpyFromRotation(fine[i].T_map_vehicle.linear());
    worst = std::max(worst, error.head<2>().cwiseAbs().maxCoeff());
    const auto before = navigation.StateAt(At(fine[i].t - 0.003));
    const Eigen::Vector3d step = state->T_map_vehicle.translation() -
                                 before->T_map_vehicle.translation() - 0.003 * state->v_map_mps;
    worst_step_m = std::max(worst_step_m, step.norm());
  }
  EXPECT_LT(Rad2Deg(worst), 0.01);
  EXPECT_LT(worst_step_m, 0.001);
}

TEST(DeadReckoning, StatesOnceGivenStay) {
  NavigationParams params;
  const Stream stream = MakeStream(20.0, params);
  DeadReckoning navigation(params, TestVehicle());
  std::vector<std::pair<Time, Eigen::Isometry3d>> given;
  std::size_t dvl = 0;
  std::size_t depth = 0;
  for (std::size_t i = 0; i < stream.imu.size(); ++i) {
    navigation.Add(stream.imu[i]);
    if (i % 10 == 0) navigation.Add(stream.depth[depth++]);
    if (i % 20 == 0) navigation.Add(stream.dvl[dvl++]);
    if (const auto t = navigation.latest(); t && i % 7 == 0) {
      const Time asked = *t - FromSeconds(0.004);
      if (const auto state = navigation.StateAt(asked))
        given.emplace_back(asked, state->T_map_vehicle);
    }
  }
  ASSERT_GT(given.size(), 100u);
  for (const auto& [t, T] : given)
    EXPECT_TRUE(navigation.StateAt(t)->T_map_vehicle.matrix() == T.matrix());
}

// A dive that stops at stop_s and goes on at resume_s.
struct InterruptedDive {
  InterruptedDive(double stop_s, double resume_s, double since_s, std::uint32_t seed)
      : truth(Truth(LawnMower(100.0, 4), TestVehicle(), 420.0, kImuHz)),
        sensors(params, kImuHz, seed),
        before(params, TestVehicle()),
        after(params, TestVehicle()) {
    Feed(Part(0.0, stop_s), {}, &sensors, &before);
    saved = before.Save(At(since_s)).value();
    restored = after.Restore(saved);
    Feed(Part(resume_s, truth.back().t), {}, &sensors, &after);
  }
  std::vector<TruthState> Part(double from_s, double to_s) const {
    return {truth.begin() + static_cast<std::ptrdiff_t>(Index(from_s)),
            truth.begin() + static_cast<std::ptrdiff_t>(Index(to_s))};
  }

  NavigationParams params;
  std::vector<TruthState> truth;
  Sensors sensors;
  DeadReckoning before;
  DeadReckoning after;
  std::vector<std::uint8_t> saved;
  bool restored = false;
};

TEST(DeadReckoningRestart, KnowsNothingOfWhatItHasForgotten) {
  const InterruptedDive dive(200.0, 230.0, 150.0, 1);
  ASSERT_TRUE(dive.restored);
  EXPECT_FALSE(dive.after.StateAt(At(175.0)));
  EXPECT_FALSE(dive.after.RelativeCovariance(At(175.0), At(400.0)));
  EXPECT_FALSE(dive.after.RelativeCovariance(At(100.0), At(400.0)));
  EXPECT_TRUE(dive.after.RelativeCovariance(At(150.0), At(400.0)));
}

TEST(DeadReckoningRestart, RefusesBytesThatAreNotWhole) {
  const InterruptedDive dive(30.0, 40.0, 20.0, 1);
  for (std::size_t size = 0; size < dive.saved.size(); ++size) {
    if (size > 64 && size % 97 != 0) continue;
    DeadReckoning navigation(dive.params, TestVehicle());
    EXPECT_FALSE(navigation.Restore(Bytes(dive.saved).first(size))) << size;
    EXPECT_FALSE(navigation.latest());
  }
}

// Relative poses across a restart of half a minute, in which the vehicle turns, by their own
// covariances: chi-square with 3 degrees of freedom a dive.
TEST(DeadReckoningRestart, StatesItsErrorOverTheGap) {
  constexpr int kDives = 8;
  double nees = 0.0;
  for (std::uint32_t seed = 1; seed <= kDives; ++seed) {
    const InterruptedDive dive(200.0, 230.0, 150.0, seed);
    const auto from = dive.before.StateAt(At(150.0));
    const auto to = dive.after.StateAt(At(400.0));
    const auto covariance = dive.after.RelativeCovariance(At(150.0), At(400.0));
    ASSERT_TRUE(from && to && covariance);
    const Pose2 measured = Inverse(LevelPose(from->T_map_vehicle)) * LevelPose(to->T_map_vehicle);
    const Pose2 is = Inverse(LevelPose(dive.truth[Index(150.0)].T_map_vehicle)) *
                     LevelPose(dive.truth[Index(400.0)].T_map_vehicle);
    Eigen::Vector3d error = measured.Vector() - is.Vector();
    error[2] = WrapAngle(error[2]);
    nees += error.dot(covariance->ldlt().solve(error));
  }
  // Above the band would be a lie. Below it stays a gap that is guessed with room to spare.
  EXPECT_LT(nees / (3.0 * kDives), 2.2);
}

}  // namespace
}  // namespace seastitch
