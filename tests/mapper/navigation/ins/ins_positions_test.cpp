#include "tests/mapper/navigation/ins/ins_fixtures.hpp"

namespace seastitch {
namespace {

// --- what is given -------------------------------------------------------------------------------

TEST(InsNavigation, TakesPositionFromTheInsToTheVehicle) {
  VehicleGeometry vehicle;
  vehicle.T_vehicle_imu = MakePose({2.0, 1.0, -3.0}, RotationFromRpy(0.0, 0.0, Deg2Rad(90.0)));
  InsNavigation navigation({}, {}, vehicle);
  // The vehicle looks east: its INS, turned by 90 degrees, looks south.
  for (int i = 0; i < 100; ++i)
    navigation.Add(SampleOf(0.1 * i, {100.0, 50.0}, Deg2Rad(180.0), std::nullopt));
  navigation.Finish();
  const auto state = navigation.StateAt(At(5.0));
  ASSERT_TRUE(state);
  EXPECT_NEAR(LevelPose(state->T_map_vehicle).yaw, Deg2Rad(90.0), 1e-9);
  const Eigen::Vector3d expected(101.0, 48.0, 13.0);
  EXPECT_LT((state->T_map_vehicle.translation() - expected).norm(), 1e-6);
}

TEST(InsNavigation, HoldsPositionForTwoSecondsAndNoLonger) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i <= 200; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, Eigen::Vector2d(2.0, 0.0));
    if (i > 100 && i < 180) sample.position.reset();
    navigation.Add(sample);
  }
  navigation.Finish();
  const auto held = navigation.StateAt(At(11.9));
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->T_map_vehicle.translation().x(), 23.8, 1e-6);
  EXPECT_FALSE(navigation.StateAt(At(12.5)));
  EXPECT_TRUE(navigation.StateAt(At(18.5)));
}

TEST(InsNavigation, HoldsPositionBeforeTheFirst) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i <= 100; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, std::nullopt);
    if (i < 50 || i % 5 != 0) sample.position.reset();
    navigation.Add(sample);
  }
  navigation.Finish();
  const auto held = navigation.StateAt(At(3.5));
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->T_map_vehicle.translation().x(), 7.0, 1e-6);
  EXPECT_FALSE(navigation.StateAt(At(2.9)));
}

TEST(InsNavigation, OnePositionWithoutVelocityIsNotHeld) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i <= 100; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.0, 0.0}, 0.0, std::nullopt);
    if (i != 50) sample.position.reset();
    navigation.Add(sample);
  }
  navigation.Finish();
  EXPECT_TRUE(navigation.StateAt(At(5.0)));
  EXPECT_FALSE(navigation.StateAt(At(5.5)));
}

TEST(InsNavigation, StatesDoNotChangeOnceGiven) {
  InsNavigation navigation({}, {}, {});
  Rng rng(5);
  std::map<int, Eigen::Vector3d> given;
  for (int i = 0; i < 2000; ++i) {
    const double jump = i > 1000 ? 3.0 : 0.0;
    NavigationSample sample =
        SampleOf(0.1 * i, {0.2 * i + jump, 0.02 * Normal(&rng)}, 0.0, Eigen::Vector2d(2.0, 0.0));
    if (i % 10 != 0 && (i / 300) % 2 == 0) sample.position.reset();
    if (i > 1500 && i < 1550) sample.position.reset();
    navigation.Add(sample);
    const auto latest = navigation.latest();
    for (int k = 0; latest && At(0.1 * k) <= *latest; ++k) {
      const auto state = navigation.StateAt(At(0.1 * k));
      if (!state) continue;
      const auto [known, is_new] = given.emplace(k, state->T_map_vehicle.translation());
      if (is_new) continue;
      ASSERT_EQ(known->second, state->T_map_vehicle.translation()) << k;
    }
  }
  EXPECT_GT(given.size(), 1800u);
}

// --- fixes of other sensors ----------------------------------------------------------------------

PositionFix FixOf(double t_s, const Eigen::Vector2d& north_east_m, const char* source) {
  const NavigationSample place = SampleOf(t_s, north_east_m, 0.0, std::nullopt);
  PositionFix fix;
  fix.time = place.time;
  fix.latitude_rad = place.position->latitude_rad;
  fix.longitude_rad = place.position->longitude_rad;
  fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  fix.source = source;
  return fix;
}

std::int64_t CountOf(const InsNavigation& navigation, const std::string& name) {
  const auto found = navigation.counters().find(name);
  return found == navigation.counters().end() ? 0 : found->second;
}

// GPS at 10 Hz at the surface for half an hour without a submap: errors of a minute are alike, so
// that 18,000 fixes are no 18,000 measurements, and they must neither be compared nor stored.
TEST(InsNavigation, ManyFixesOfOneSourceCountAsOneInTenSeconds) {
  InsNavigation navigation({}, {}, {});
  constexpr int kSamples = 18'000;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector2d p(0.2 * i, 0.0);
    navigation.Add(SampleOf(0.1 * i, p, 0.0, Eigen::Vector2d(2.0, 0.0)));
    navigation.Add(FixOf(0.1 * i, p + Eigen::Vector2d(0.0, 3.0), "gps"));
  }
  navigation.Finish();
  const std::vector<MapFix> waiting = navigation.WaitingFixes();
  EXPECT_EQ(waiting.size(), 180u);
  EXPECT_EQ(CountOf(navigation, "fix_thinned"), kSamples - 180);
  for (const MapFix& fix : waiting) {
    const double t_s = ToSeconds(fix.time - At(0.0));
    EXPECT_LT((fix.north_east_m - Eigen::Vector2d(2.0 * t_s, 3.0)).norm(), 0.01) << t_s;
  }
  EXPECT_EQ(navigation.TakeFixes(At(kSamples)).size(), 180u);
  EXPECT_TRUE(navigation.WaitingFixes().empty()) << "each is returned once";
}

TEST(InsNavigation, EveryFixIsGivenOnceOrCounted) {
  NavigationParams params;
  params.window_s = 600.0;
  InsNavigation navigation({}, params, {});
  navigation.Add(FixOf(-3.0, {0.0, 0.0}, "before"));
  for (int i = 0; i <= 10'000; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, Eigen::Vector2d(2.0, 0.0));
    if (i > 5000 && i < 5100) sample.position.reset();
    navigation.Add(sample);
  }
  navigation.Add(FixOf(900.0, {1800.0, 0.0}, "late"));
  navigation.Add(FixOf(505.0, {1010.0, 0.0}, "in the gap"));
  navigation.Add(FixOf(200.0, {400.0, 0.0}, "too late"));
  navigation.Add(FixOf(1100.0, {0.0, 0.0}, "of another clock"));
  navigation.Add(FixOf(1001.0, {2002.0, 0.0}, "after the end"));
  navigation.Finish();
  const std::vector<MapFix> fixes = navigation.TakeFixes(At(2000.0));
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].time, At(900.0));
  EXPECT_EQ(CountOf(navigation, "fix_late"), 1);
  EXPECT_EQ(CountOf(navigation, "fix_without_pose"), 3) << "before, in the gap, after the end";
  EXPECT_EQ(CountOf(navigation, "fix_ahead"), 1);
}

// --- the newest sample ---------------------------------------------------------------------------

// The search for jumps needs 15 positions or 5 s. The state for the autopilot must not wait.
TEST(InsNavigation, PredictsToTheNewestSampleAlsoInATurn) {
  for (const bool velocity : {true, false}) {
    SCOPED_TRACE(velocity ? "with velocities" : "without velocities");
    InsNavigation navigation({}, {}, {});
    Eigen::Vector2d p = Eigen::Vector2d::Zero();
    double largest_m = 0.0, largest_delay_s = 0.0;
    for (int i = 0; i < 3000; ++i) {
      const double yaw = TrueYaw(0.1 * i);
      const Eigen::Vector2d v = 2.0 * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
      NavigationSample sample =
          SampleOf(0.1 * i, p, yaw, velocity ? std::optional(v) : std::nullopt);
      sample.depth->value_m = 10.0 + 0.01 * i;
      if (i % 5 != 0) sample.position.reset();
      navigation.Add(sample);
      const auto now = navigation.Predicted();
      if (i > 100) {
        ASSERT_TRUE(now);
        ASSERT_EQ(now->time, sample.time);
        largest_m = std::max(largest_m, (now->T_map_vehicle.translation().head<2>() - p).norm());
        EXPECT_NEAR(now->T_map_vehicle.translation().z(), sample.depth->value_m, 1e-6);
        EXPECT_NEAR(WrapAngle(LevelPose(now->T_map_vehicle).yaw - yaw), 0.0, 1e-6);
        EXPECT_NEAR(now->v_map_mps.norm(), 2.0, 0.1);
        const auto last = navigation.StateAt(*navigation.latest());
        largest_delay_s = std::max(largest_delay_s, ToSeconds(now->time - last->time));
        EXPECT_GT(now->covariance(0, 0), last->covariance(0, 0));
      }
      p += 0.1 * v;
    }
    EXPECT_GT(largest_delay_s, 4.0) << "otherwise there is nothing to predict";
    // 10 m without a prediction. The velocity from two positions is that of half a second earlier.
    EXPECT_LT(largest_m, velocity ? 0.1 : 0.6);
  }
}

TEST(InsNavigation, PredictsNotBeyondTwoSecondsWithoutAPosition) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i <= 200; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, Eigen::Vector2d(2.0, 0.0));
    if (i > 100) sample.position.reset();
    navigation.Add(sample);
  }
  const auto now = navigation.Predicted();
  ASSERT_TRUE(now);
  EXPECT_LE(now->time, At(12.0));
}

// --- over a restart ------------------------------------------------------------------------------

// Lines and turns, with noise, jumps of the position, and fixes from elsewhere.
std::vector<std::variant<NavigationSample, PositionFix>> Survey(double duration_s) {
  std::vector<std::variant<NavigationSample, PositionFix>> samples;
  Rng rng(8);
  Eigen::Vector2d p = Eigen::Vector2d::Zero();
  Eigen::Vector2d error = Eigen::Vector2d::Zero();
  for (int i = 0; i < static_cast<int>(10.0 * duration_s); ++i) {
    const double yaw = TrueYaw(0.1 * i);
    const Eigen::Vector2d v = 2.0 * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
    p += 0.1 * v;
    if (i % 1000 == 999) error += Eigen::Vector2d(2.0, -1.0);
    NavigationSample sample = SampleOf(0.1 * i, p + error, yaw, v);
    sample.position->latitude_rad += 1e-8 * Normal(&rng);
    if (i % 5 != 0) sample.position.reset();
    if (i % 2 != 0) sample.depth.reset();
    samples.emplace_back(sample);
    if (i % 400 != 200) continue;
    samples.emplace_back(FixOf(0.1 * i, p, ""));
  }
  return samples;
}

TEST(InsNavigation, GoesOnAfterARestartAsIfThereWereNone) {
  InsNavigationParams params;
  params.heading_rad = 0.01;
  params.heading_wander_rad = {0.005, 300.0};
  VehicleGeometry vehicle;
  vehicle.T_vehicle_imu.translation() << 1.0, 0.5, 0.2;
  const auto samples = Survey(700.0);
  const auto feed = [](const auto& sample, InsNavigation* navigation) {
    std::visit([&](const auto& s) { navigation->Add(s); }, sample);
  };
  Rng rng(9);
  std::uniform_int_distribution<std::size_t> moment(1500, samples.size() - 300);
  std::size_t most_bytes = 0;
  for (int run = 0; run < 30; ++run) {
    const std::size_t stop = moment(rng);
    SCOPED_TRACE("stopped after sample " + std::to_string(stop));
    InsNavigation whole(params, {}, vehicle);
    for (std::size_t i = 0; i <= stop; ++i) feed(samples[i], &whole);
    const Time since = *whole.latest() - FromSeconds(50.0 + run);
    const auto saved = whole.Save(since);
    ASSERT_TRUE(saved);
    most_bytes = std::max(most_bytes, saved->size());
    InsNavigation resumed(params, {}, vehicle);
    ASSERT_TRUE(resumed.Restore(*saved));
    for (std::size_t i = stop + 1; i < samples.size(); ++i) {
      feed(samples[i], &whole);
      feed(samples[i], &resumed);
      ASSERT_EQ(whole.latest(), resumed.latest());
    }
    const auto a = whole.StateAt(*whole.latest());
    const auto b = resumed.StateAt(*resumed.latest());
    ASSERT_TRUE(a && b);
    EXPECT_TRUE(a->T_map_vehicle.matrix() == b->T_map_vehicle.matrix());
    EXPECT_TRUE(a->covariance == b->covariance);
    const auto of_a = whole.RelativeCovariance(since, *whole.latest());
    const auto of_b = resumed.RelativeCovariance(since, *resumed.latest());
    ASSERT_TRUE(of_a && of_b);
    EXPECT_TRUE(of_a->isApprox(*of_b, 1e-3)) << *of_a << "\n\n" << *of_b;
    const auto fixes = whole.TakeFixes(*whole.latest());
    const auto also = resumed.TakeFixes(*resumed.latest());
    ASSERT_EQ(fixes.size(), also.size());
    for (std::size_t i = 0; i < fixes.size(); ++i)
      EXPECT_EQ(fixes[i].north_east_m, also[i].north_east_m);
    EXPECT_FALSE(resumed.StateAt(since - FromSeconds(10.0))) << "not known any more";
  }
  std::printf("at most %zu bytes\n", most_bytes);
  EXPECT_LT(most_bytes, 60'000U);
}

TEST(InsNavigation, TakesNoBytesThatAreNone) {
  const auto samples = Survey(60.0);
  InsNavigation navigation({}, {}, {});
  EXPECT_FALSE(navigation.Save(std::nullopt)) << "before the start";
  for (const auto& sample : samples) std::visit([&](const auto& s) { navigation.Add(s); }, sample);
  const auto saved = *navigation.Save(std::nullopt);
  for (std::size_t size = 0; size < saved.size(); ++size) {
    InsNavigation other({}, {}, {});
    ASSERT_FALSE(other.Restore(Bytes(saved.data(), size))) << size;
    ASSERT_FALSE(other.latest());
  }
}

TEST(InsNavigation, WithoutDepthThereIsNoPose) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i < 100; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, std::nullopt);
    sample.depth.reset();
    navigation.Add(sample);
  }
  navigation.Finish();
  EXPECT_FALSE(navigation.latest());
}

// The depth of the INS ends; that of a pressure sensor, refused until then, takes over.
TEST(InsNavigation, APressureSensorTakesOverFromAnInsThatGivesNoDepthAnyMore) {
  InsNavigation navigation({}, {}, {});
  for (int i = 0; i < 400; ++i) {
    NavigationSample sample = SampleOf(0.1 * i, {0.2 * i, 0.0}, 0.0, std::nullopt);
    if (i >= 100) sample.depth.reset();
    navigation.Add(sample);
    navigation.Add(DepthSample{sample.time, 0.0, 12.0, 0.01});
  }
  navigation.Finish();
  ASSERT_TRUE(navigation.latest());
  EXPECT_GT(ToSeconds(*navigation.latest() - At(0.0)), 39.0);
  EXPECT_NEAR(navigation.StateAt(At(5.0))->T_map_vehicle.translation().z(), 10.0, 1e-6);
  EXPECT_NEAR(navigation.StateAt(At(39.0))->T_map_vehicle.translation().z(), 12.0, 1e-6);
}

}  // namespace
}  // namespace seastitch
