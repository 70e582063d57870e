#include "tests/mapper/navigation/ins/ins_fixtures.hpp"

namespace seastitch {
namespace {

// --- jumps ---------------------------------------------------------------------------------------

struct JumpTrial {
  std::vector<MapFix> fixes;
  std::int64_t jumps = 0;
  double largest_step_m = 0.0;  // of the track
  double largest_off_m = 0.0;   // of the track from the truth, by the places where both begin
};

struct JumpSurvey {
  double jump_m = 0.0;  // every 100 s
  int jumps = 10;
  double spike_m = 0.0;
  bool velocity = true;  // with 0.02 m/s of noise
  double rate_hz = 5.0;
  double noise_m = 0.1;
  double jump_takes_s = 0.0;                                      // 0: it is sudden
  double lag_s = 0.0;                                             // of the velocity
  Eigen::Vector2d not_in_velocity_mps = Eigen::Vector2d::Zero();  // as of one through the water
  double walk_m_per_rts = 0.0;  // of the position: an INS that corrects itself all the time
  bool follow_velocity = false;
  double lever_m = 0.0;   // of the INS, forward of the vehicle's reference point
  bool restless = false;  // turns of 5 m radius, comes to a stop and sets off again, side current
};

// Speed and heading of lines and turns of 20 s; or of a vehicle that does all there is to do.
Eigen::Vector2d TrueVelocity(const JumpSurvey& survey, double t_s, double* yaw_rad) {
  *yaw_rad = TrueYaw(t_s);
  double speed_mps = 2.0;
  Eigen::Vector2d current_mps = Eigen::Vector2d::Zero();
  if (survey.restless) {
    const double in_leg_s = std::fmod(t_s, 40.0);  // of which 10 s are the turn
    *yaw_rad = 0.3 * (10.0 * std::floor(t_s / 40.0) + std::max(0.0, in_leg_s - 30.0));
    speed_mps = 1.5 * std::clamp(std::abs(std::fmod(t_s, 100.0) - 50.0) / 3.0 - 1.0, 0.0, 1.0);
    current_mps = {0.1, 0.3};
  }
  return speed_mps * Eigen::Vector2d(std::cos(*yaw_rad), std::sin(*yaw_rad)) + current_mps;
}

// Drawn one by one: the order of a call's arguments is the compiler's.
Eigen::Vector2d NormalPair(Rng* rng) {
  const double y = Normal(rng), x = Normal(rng);
  return {x, y};
}

JumpTrial RunJumps(const JumpSurvey& survey, Rng* rng) {
  InsNavigationParams params;
  params.follow_velocity = survey.follow_velocity;
  VehicleGeometry vehicle;
  vehicle.T_vehicle_imu.translation().x() = survey.lever_m;
  InsNavigation navigation(params, NavigationParams{}, vehicle);
  JumpTrial trial;
  const double dt_s = 1.0 / survey.rate_hz;
  const auto lever_at = [&survey](double t_s) -> Eigen::Vector2d {
    double yaw_rad = 0.0;
    TrueVelocity(survey, t_s, &yaw_rad);
    return survey.lever_m * Eigen::Vector2d(std::cos(yaw_rad), std::sin(yaw_rad));
  };
  const int between = static_cast<int>(100.0 * survey.rate_hz);
  Eigen::Vector2d p = Eigen::Vector2d::Zero();
  Eigen::Vector2d error = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_come = Eigen::Vector2d::Zero();  // of the last jump
  for (int i = 0; i < (survey.jumps + 1) * between; ++i) {
    const Time t = At(dt_s * i);
    double yaw = 0.0;
    const Eigen::Vector2d v = TrueVelocity(survey, dt_s * i, &yaw);
    p += dt_s * v;
    if (i > 0 && i % between == 0) {
      const double direction = 2.0 * kPi * Normal(rng);
      to_come = survey.jump_m * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    }
    const double share = std::min(1.0, dt_s / std::max(survey.jump_takes_s, dt_s));
    const double left = std::max(0.0, survey.jump_takes_s - std::fmod(dt_s * i, 100.0));
    const bool moves = i >= between && (survey.jump_takes_s == 0.0 ? i % between == 0 : left > 0.0);
    if (moves) error += share * to_come;
    error += survey.walk_m_per_rts * std::sqrt(dt_s) * NormalPair(rng);
    Eigen::Vector2d given = p + lever_at(dt_s * i) + error + survey.noise_m * NormalPair(rng);
    if (i % between == between / 2) given.x() += survey.spike_m;
    double yaw_then = 0.0;
    const Eigen::Vector2d v_given =
        TrueVelocity(survey, dt_s * i - survey.lag_s, &yaw_then) - survey.not_in_velocity_mps +
        (lever_at(dt_s * i) - lever_at(dt_s * (i - 1))) / dt_s + 0.02 * NormalPair(rng);
    navigation.Add(
        SampleOf(dt_s * i, given, yaw, survey.velocity ? std::optional(v_given) : std::nullopt));
    for (const MapFix& fix : navigation.TakeFixes(t)) trial.fixes.push_back(fix);
  }
  navigation.Finish();
  trial.jumps = navigation.counters().contains("ins_position_jumps")
                    ? navigation.counters().at("ins_position_jumps")
                    : 0;
  std::optional<Eigen::Vector2d> last;
  Eigen::Vector2d begin = Eigen::Vector2d::Zero();
  p.setZero();
  for (int i = 0; i < (survey.jumps + 1) * between; ++i) {
    double yaw = 0.0;
    p += dt_s * TrueVelocity(survey, dt_s * i, &yaw);
    const auto state = navigation.StateAt(At(dt_s * i));
    if (!state) continue;
    const Eigen::Vector2d at = state->T_map_vehicle.translation().head<2>();
    if (!last) begin = at - p;
    trial.largest_off_m = std::max(trial.largest_off_m, (at - p - begin).norm());
    if (last) trial.largest_step_m = std::max(trial.largest_step_m, (at - *last).norm());
    last = at;
  }
  return trial;
}

// With the velocity of the INS, and of files that have none.
TEST(InsNavigation, FindsEveryJumpOfOneMetreAmongTenCentimetresOfNoise) {
  for (const bool velocity : {true, false}) {
    SCOPED_TRACE(velocity ? "with velocities" : "positions alone");
    int found = 0;
    int in_place = 0;
    Rng rng(1);
    for (int trial = 0; trial < 10; ++trial) {
      const JumpTrial jumps = RunJumps({.jump_m = 1.0, .velocity = velocity}, &rng);
      EXPECT_EQ(jumps.jumps, 10);
      found += static_cast<int>(jumps.jumps);
      for (std::size_t i = 0; i < jumps.fixes.size(); ++i) {
        const double off_s =
            ToSeconds(jumps.fixes[i].time - At(100.0 * static_cast<double>(i + 1)));
        in_place += std::abs(off_s) < 0.5 ? 1 : 0;
      }
      // 0.4 m of way, and noise.
      EXPECT_LT(jumps.largest_step_m, 1.2);
    }
    std::printf(
        "jumps of 1 m found: %d of 100, at their place to a sample or two: %d\n", found, in_place);
    EXPECT_EQ(found, 100);
    EXPECT_EQ(in_place, 100);
  }
}

TEST(InsNavigation, InventsNoJump) {
  Rng rng(2);
  for (int trial = 0; trial < 20; ++trial) EXPECT_EQ(RunJumps({}, &rng).jumps, 0);
}

// An INS that learns in a turn that its heading was wrong moves its position within seconds: that
// is no way that the vehicle went. A step is 0.4 m of way, and noise.
TEST(InsNavigation, TakesASlideOfSecondsOutOfTheTrack) {
  Rng rng(5);
  for (const double noise_m : {0.0, 0.02, 0.1}) {
    SCOPED_TRACE(noise_m);
    const JumpTrial slides =
        RunJumps({.jump_m = 6.0, .noise_m = noise_m, .jump_takes_s = 4.0}, &rng);
    EXPECT_EQ(slides.jumps, 10);
    EXPECT_LT(slides.largest_off_m, 1.5);  // of some 20 m that ten slides of any direction make
  }
}

// An INS that corrects its position by some centimetres all the time, and jumps now and then. Only
// its velocity is how the vehicle moved.
TEST(InsNavigation, FollowsTheVelocityIfThatIsStated) {
  for (const double takes_s : {0.0, 4.0}) {
    JumpSurvey survey{
        .jump_m = 6.0, .noise_m = 0.0, .jump_takes_s = takes_s, .walk_m_per_rts = 0.03};
    Rng rng(8);
    const JumpTrial by_position = RunJumps(survey, &rng);
    survey.follow_velocity = true;
    rng.seed(8);
    const JumpTrial by_velocity = RunJumps(survey, &rng);
    std::printf("off by %.2f m, %.2f m where the velocity is followed\n",
                by_position.largest_off_m,
                by_velocity.largest_off_m);
    EXPECT_EQ(by_velocity.jumps, 10);
    EXPECT_GT(by_position.largest_off_m, 1.0);
    EXPECT_LT(by_velocity.largest_off_m, 0.5);
    EXPECT_LT(by_velocity.largest_step_m, 0.43) << "0.4 m of way";
  }
  Rng rng(8);
  const JumpTrial alone =
      RunJumps({.jump_m = 1.0, .velocity = false, .follow_velocity = true}, &rng);
  EXPECT_EQ(alone.jumps, 10) << "positions alone are followed as ever";
  EXPECT_LT(alone.largest_off_m, 1.5);
}

// In a turn of 180 degrees an INS 5 m ahead of the reference point moves 10 m relative to it. Its
// velocity shows that.
TEST(InsNavigation, TakesALeverArmForNoSlide) {
  for (const bool follow : {false, true}) {
    Rng rng(9);
    const JumpTrial none =
        RunJumps({.noise_m = 0.02, .follow_velocity = follow, .lever_m = 5.0}, &rng);
    EXPECT_EQ(none.jumps, 0);
    EXPECT_LT(none.largest_off_m, 0.6);
  }
}

// A velocity that lags in turns, or is one through the water, is no reason to distrust positions.
TEST(InsNavigation, TakesAnErrorOfTheVelocityForNoSlide) {
  Rng rng(6);
  for (const JumpSurvey& survey :
       {JumpSurvey{.lag_s = 0.2},
        JumpSurvey{.noise_m = 0.02, .lag_s = 0.2},
        JumpSurvey{.not_in_velocity_mps = {0.5, 0.3}},
        JumpSurvey{.noise_m = 0.02, .not_in_velocity_mps = {0.5, 0.3}, .restless = true}}) {
    SCOPED_TRACE(testing::Message() << survey.lag_s << " s late, " << survey.noise_m << " m");
    const JumpTrial none = RunJumps(survey, &rng);
    EXPECT_EQ(none.jumps, 0);
    EXPECT_LT(none.largest_off_m, 1.0);
  }
}

// Nor where it has to tell a jump from turns, stops and starts by the positions themselves.
TEST(InsNavigation, InventsNoJumpWithoutVelocities) {
  Rng rng(2);
  for (const bool restless : {false, true})
    for (const double rate_hz : {1.0, 5.0})
      for (const double noise_m : {0.0, 0.02, 0.1, 1.0}) {
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << noise_m << " m, " << restless);
        const JumpSurvey survey{
            .velocity = false, .rate_hz = rate_hz, .noise_m = noise_m, .restless = restless};
        for (int trial = 0; trial < 5; ++trial) EXPECT_EQ(RunJumps(survey, &rng).jumps, 0);
      }
}

TEST(InsNavigation, FindsJumpsAmongPositionsOnceASecond) {
  Rng rng(4);
  const JumpTrial trial =
      RunJumps({.jump_m = 1.0, .velocity = false, .rate_hz = 1.0, .noise_m = 0.02}, &rng);
  EXPECT_EQ(trial.jumps, 10);
}

TEST(InsNavigation, TakesASpikeForNoJump) {
  for (const bool velocity : {true, false}) {
    Rng rng(3);
    const JumpTrial trial = RunJumps({.spike_m = 50.0, .velocity = velocity}, &rng);
    EXPECT_EQ(trial.jumps, 0);
    EXPECT_LT(trial.largest_step_m, 1.5);
  }
}

// --- covariance ----------------------------------------------------------------------------------

// Mean normalised squared error of relative poses of an INS that errs as its data sheet says, over
// 3: 1 of an honest covariance.
double MeanNees(const InsNavigationParams& params, double lag_s, int trials) {
  constexpr double kDt = 1.0;
  constexpr double kDuration = 1800.0;
  double sum = 0.0;
  int n = 0;
  Rng rng(7);
  for (int trial = 0; trial < trials; ++trial) {
    InsNavigation navigation(params, NavigationParams{}, VehicleGeometry{});
    const double constant = params.heading_rad * Normal(&rng);
    const GaussMarkov<double>& w = params.heading_wander_rad;
    double wander = w.sigma * Normal(&rng);
    const double keep = std::exp(-kDt / w.tau_s);
    const double scale = params.distance_ratio * Normal(&rng);
    std::vector<Pose2> truth;
    Eigen::Vector2d p = Eigen::Vector2d::Zero();
    Eigen::Vector2d given = Eigen::Vector2d::Zero();
    for (double t = 0.0; t < kDuration; t += kDt) {
      const double yaw = TrueYaw(t);
      const double error = constant + wander;
      const double way = 2.0 * kDt;
      truth.push_back({p.x(), p.y(), yaw});
      navigation.Add(SampleOf(t, given, yaw + error, std::nullopt));
      p += way * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
      const double along = params.uses_position_fixes ? yaw : yaw + error;
      given += (1.0 + scale) * way * Eigen::Vector2d(std::cos(along), std::sin(along)) +
               params.random_walk_m_per_rtm * std::sqrt(way) * NormalPair(&rng);
      wander = keep * wander + std::sqrt(1.0 - keep * keep) * w.sigma * Normal(&rng);
    }
    navigation.Finish();
    for (double t = 100.0; t + lag_s < kDuration - 10.0; t += lag_s) {
      const auto a = navigation.StateAt(At(t));
      const auto b = navigation.StateAt(At(t + lag_s));
      const auto covariance = navigation.RelativeCovariance(At(t), At(t + lag_s));
      if (!a || !b || !covariance) {
        ADD_FAILURE() << "not known at " << t;
        return 0.0;
      }
      const Pose2 told = Inverse(LevelPose(a->T_map_vehicle)) * LevelPose(b->T_map_vehicle);
      const Pose2 is =
          Inverse(truth[static_cast<std::size_t>(t)]) * truth[static_cast<std::size_t>(t + lag_s)];
      Eigen::Vector3d e = told.Vector() - is.Vector();
      e.z() = WrapAngle(e.z());
      sum += e.dot(covariance->ldlt().solve(e)) / 3.0;
      ++n;
    }
  }
  return sum / n;
}

TEST(InsNavigationMonteCarlo, RelativeCovarianceIsHonest) {
  for (const bool fixed : {false, true}) {
    InsNavigationParams params;
    params.uses_position_fixes = fixed;
    for (const double lag_s : {20.0, 100.0, 400.0, 800.0}) {
      const double nees = MeanNees(params, lag_s, 100);
      std::printf("%s, %3.0f s: mean NEES %.3f of 1\n",
                  fixed ? "fixed all the time" : "dead reckoning",
                  lag_s,
                  nees);
      EXPECT_GT(nees, 0.8);
      EXPECT_LT(nees, 1.25);
    }
  }
}

}  // namespace
}  // namespace seastitch
