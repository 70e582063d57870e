#include "tests/mapper/navigation/dead_reckoning_fixtures.hpp"

namespace seastitch {
namespace {

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

}  // namespace
}  // namespace seastitch
