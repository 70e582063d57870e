#include "tests/mapper/navigation/dead_reckoning_fixtures.hpp"

namespace seastitch {
namespace {

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

}  // namespace
}  // namespace seastitch
