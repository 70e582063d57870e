#include "tests/mapper/navigation/dead_reckoning_fixtures.hpp"

namespace seastitch {
namespace {

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
