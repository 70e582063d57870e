#include "mapper/geometry/sound_ray.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

SoundVelocityProfile Profile(std::vector<double> depth_m, std::vector<double> speed_mps) {
  SoundVelocityProfile profile;
  profile.depth_m = std::move(depth_m);
  profile.speed_mps = std::move(speed_mps);
  return profile;
}

// Warm layer, thermocline, a sound channel and noise on top: nothing smooth about it.
SoundVelocityProfile WildProfile() {
  SoundVelocityProfile profile;
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (double z = 0.5; z < 150.0; z += 1.7) {
    const double speed =
        1500.0 - 25.0 * std::tanh((z - 30.0) / 8.0) + 0.08 * std::max(0.0, z - 70.0);
    profile.depth_m.push_back(z);
    profile.speed_mps.push_back(speed + noise(random));
  }
  return profile;
}

std::optional<RayEnd> TraceAngle(
    const RayTracer& rays, double depth_m, double angle_rad, double speed_mps, double time_s) {
  return rays.Trace(depth_m, std::sin(angle_rad), std::cos(angle_rad), speed_mps, time_s);
}

// The ray equations (Jensen et al., 3.23) by fourth-order Runge-Kutta in small steps of time, on
// speeds looked up by a search of its own.
RayEnd March(const SoundVelocityProfile& profile,
             double depth_m,
             double angle_rad,
             double speed_at_transducer_mps,
             double time_s,
             int steps) {
  const auto speed = [&](double z) {
    if (z <= profile.depth_m.front()) return profile.speed_mps.front();
    for (std::size_t i = 1; i < profile.depth_m.size(); ++i) {
      if (z > profile.depth_m[i]) continue;
      const double w = (z - profile.depth_m[i - 1]) / (profile.depth_m[i] - profile.depth_m[i - 1]);
      return (1.0 - w) * profile.speed_mps[i - 1] + w * profile.speed_mps[i];
    }
    return profile.speed_mps.back();
  };
  const double p = std::sin(angle_rad) / speed_at_transducer_mps;
  const double dt = time_s / steps;
  double x = 0.0;
  double z = depth_m;
  for (int i = 0; i < steps; ++i) {
    const auto slope = [&](double at_z) {
      const double c = speed(at_z);
      return std::pair(p * c * c, c * std::sqrt(1.0 - p * p * c * c));
    };
    const auto [x1, z1] = slope(z);
    const auto [x2, z2] = slope(z + 0.5 * dt * z1);
    const auto [x3, z3] = slope(z + 0.5 * dt * z2);
    const auto [x4, z4] = slope(z + dt * z3);
    x += dt / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
    z += dt / 6.0 * (z1 + 2.0 * z2 + 2.0 * z3 + z4);
  }
  return {x, z - depth_m};
}

TEST(RayTracer, ConstantSpeedIsAStraightLine) {
  const RayTracer rays = RayTracer::Constant(1500.0);
  for (const double degrees : {0.0, 1e-6, 10.0, 45.0, 75.0, 89.0}) {
    const double angle = Deg2Rad(degrees);
    const auto end = TraceAngle(rays, 12.0, angle, 1500.0, 0.05);
    ASSERT_TRUE(end);
    EXPECT_NEAR(end->horizontal_m, 75.0 * std::sin(angle), 1e-10);
    EXPECT_NEAR(end->down_m, 75.0 * std::cos(angle), 1e-10);
  }
}

TEST(RayTracer, ALayerCutInPiecesBendsAsOne) {
  const auto whole = RayTracer::Make(Profile({0.0, 100.0}, {1500.0, 1480.0}));
  SoundVelocityProfile cut;
  for (int i = 0; i <= 100; ++i) {
    cut.depth_m.push_back(i);
    cut.speed_mps.push_back(1500.0 - 0.2 * i);
  }
  const auto pieces = RayTracer::Make(cut);
  const auto a = TraceAngle(*whole, 3.3, Deg2Rad(60.0), 1499.34, 0.1);
  const auto b = TraceAngle(*pieces, 3.3, Deg2Rad(60.0), 1499.34, 0.1);
  EXPECT_NEAR(a->horizontal_m, b->horizontal_m, 1e-9);
  EXPECT_NEAR(a->down_m, b->down_m, 1e-9);
}

// In a constant gradient g the ray is a circle of radius c / (g sin(angle)) about the depth where
// the speed would vanish; travelled for t, tan(angle / 2) has grown by e^(g t).
TEST(RayTracer, ConstantGradientIsACircularArc) {
  for (const double gradient : {0.3, -0.3, 0.017, 1e-7, -1e-9}) {
    const double speed_0 = 1490.0;
    const auto rays = RayTracer::Make(Profile({0.0, 200.0}, {speed_0, speed_0 + 200.0 * gradient}));
    ASSERT_TRUE(rays);
    const double start_m = 20.0;
    const double c = speed_0 + start_m * gradient;
    const double angle = Deg2Rad(50.0);
    const double t = 0.1;
    const auto end = TraceAngle(*rays, start_m, angle, c, t);
    ASSERT_TRUE(end);
    const double end_angle = 2.0 * std::atan(std::tan(angle / 2.0) * std::exp(gradient * t));
    if (std::abs(gradient) > 1e-3) {
      const double radius = c / (gradient * std::sin(angle));
      EXPECT_NEAR(end->horizontal_m, radius * (std::cos(angle) - std::cos(end_angle)), 1e-8);
      EXPECT_NEAR(end->down_m, radius * (std::sin(end_angle) - std::sin(angle)), 1e-8);
    } else {
      EXPECT_NEAR(end->horizontal_m, c * t * std::sin(angle), 1e-4);
      EXPECT_NEAR(end->down_m, c * t * std::cos(angle), 1e-4);
    }
  }
}

TEST(RayTracer, VerticalRayTakesTheIntegralOfSlowness) {
  const auto rays = RayTracer::Make(Profile({0.0, 100.0}, {1450.0, 1550.0}));
  // From 10 m to 90 m: ln(c1 / c0) / g.
  const double t = std::log(1540.0 / 1460.0) / 1.0;
  const auto end = rays->Trace(10.0, 0.0, 1.0, 1460.0, t);
  EXPECT_NEAR(end->down_m, 80.0, 1e-9);
  EXPECT_EQ(end->horizontal_m, 0.0);
}

TEST(RayTracer, FollowsAFineMarchThroughAWildProfile) {
  const SoundVelocityProfile profile = WildProfile();
  const auto rays = RayTracer::Make(profile);
  ASSERT_TRUE(rays);
  for (const double depth : {-2.0, 0.2, 5.0, 28.4, 60.0, 149.0, 160.0}) {
    for (const double degrees : {0.0, 20.0, 45.0, 60.0, 68.0}) {
      const double c = rays->SpeedAt(depth);
      const auto end = TraceAngle(*rays, depth, Deg2Rad(degrees), c, 0.06);
      const RayEnd marched = March(profile, depth, Deg2Rad(degrees), c, 0.06, 5000);
      ASSERT_TRUE(end);
      EXPECT_NEAR(end->horizontal_m, marched.horizontal_m, 1e-4) << depth << " " << degrees;
      EXPECT_NEAR(end->down_m, marched.down_m, 1e-4) << depth << " " << degrees;
    }
  }
}

TEST(RayTracer, BendsFromTheSpeedAtTheTransducerToTheNextSample) {
  const auto rays = RayTracer::Make(Profile({0.0, 20.0, 50.0}, {1500.0, 1500.0, 1510.0}));
  const auto end = TraceAngle(*rays, 10.0, Deg2Rad(60.0), 1480.0, 0.04);
  const RayEnd expected = March(Profile({10.0, 20.0, 50.0}, {1480.0, 1500.0, 1510.0}),
                                10.0,
                                Deg2Rad(60.0),
                                1480.0,
                                0.04,
                                4000);
  EXPECT_NEAR(end->horizontal_m, expected.horizontal_m, 1e-5);
  EXPECT_NEAR(end->down_m, expected.down_m, 1e-5);
  // Below the last sample the transducer's speed is all that is known.
  const auto below = TraceAngle(*rays, 60.0, Deg2Rad(60.0), 1480.0, 0.04);
  EXPECT_NEAR(below->down_m, 0.04 * 1480.0 * 0.5, 1e-9);
}

TEST(RayTracer, HoldsTheSpeedBeyondBothEndsOfTheProfile) {
  const auto rays = RayTracer::Make(Profile({10.0, 20.0}, {1500.0, 1520.0}));
  EXPECT_EQ(rays->SpeedAt(-5.0), 1500.0);
  EXPECT_EQ(rays->SpeedAt(10.0), 1500.0);
  EXPECT_EQ(rays->SpeedAt(15.0), 1510.0);
  EXPECT_EQ(rays->SpeedAt(500.0), 1520.0);
}

TEST(RayTracer, RefusesRaysThatTurnUpAndTracesThemUntilThen) {
  // 2 /s: a ray at 80 degrees turns where the speed has grown by 1 / sin(80).
  const auto rays = RayTracer::Make(Profile({0.0, 100.0}, {1500.0, 1700.0}));
  const double t_turn = std::log(1.0 / std::tan(Deg2Rad(40.0))) / 2.0;
  const auto before = TraceAngle(*rays, 0.0, Deg2Rad(80.0), 1500.0, 0.99 * t_turn);
  ASSERT_TRUE(before);
  EXPECT_NEAR(before->down_m, 1500.0 / 2.0 * (1.0 / std::sin(Deg2Rad(80.0)) - 1.0), 0.02);
  EXPECT_FALSE(TraceAngle(*rays, 0.0, Deg2Rad(80.0), 1500.0, 1.01 * t_turn));
}

TEST(RayTracer, RefusesWhatIsNoRay) {
  const RayTracer rays = RayTracer::Constant(1500.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(rays.Trace(nan, 0.5, 0.5, 1500.0, 0.1));
  EXPECT_FALSE(rays.Trace(0.0, nan, 0.5, 1500.0, 0.1));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, nan, 1500.0, 0.1));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, 0.5, nan, 0.1));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, 0.5, 1500.0, nan));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, 0.5, 1500.0, inf));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, 0.5, 1500.0, -0.1));
  EXPECT_FALSE(rays.Trace(0.0, 0.5, -0.5, 1500.0, 0.1));  // upward
  EXPECT_FALSE(rays.Trace(0.0, 1.0, 0.0, 1500.0, 0.1));   // level
  EXPECT_FALSE(rays.Trace(0.0, 0.5, 0.5, 0.0, 0.1));
}

// Every ray of pings at many depths, with the transducer's speed off the profile's and the expected
// depth right, too small and too large.
TEST(RayFan, AgreesWithRaysTracedLayerByLayer) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double worst_m = 0.0;
  for (const SoundVelocityProfile& profile :
       {WildProfile(),
        Profile({0.0, 50.0, 350.0}, {1505.9, 1505.9, 1480.0}),
        Profile({0.0, 10.0, 12.0, 80.0}, {1520.0, 1519.0, 1490.0, 1487.0}),
        Profile({5.0}, {1500.0})}) {
    const auto rays = RayTracer::Make(profile);
    ASSERT_TRUE(rays);
    for (int ping = 0; ping < 200; ++ping) {
      const double depth = -1.0 + 120.0 * uniform(random);
      const double speed = rays->SpeedAt(depth) + 4.0 * (uniform(random) - 0.5);
      const double range_m = 3.0 + 50.0 * uniform(random);
      RayFan fan(*rays, depth, speed, depth + range_m * (0.5 + uniform(random)));
      for (double degrees = 0.0; degrees < 85.0; degrees += 2.5) {
        const double angle = Deg2Rad(degrees);
        const double time_s = range_m * (0.8 + 0.4 * uniform(random)) / speed;
        const auto exact = rays->Trace(depth, std::sin(angle), std::cos(angle), speed, time_s);
        const auto quick = fan.Trace(std::sin(angle), std::cos(angle), time_s);
        ASSERT_EQ(exact.has_value(), quick.has_value()) << degrees;
        if (!exact) continue;
        worst_m = std::max({worst_m,
                            std::abs(exact->horizontal_m - quick->horizontal_m),
                            std::abs(exact->down_m - quick->down_m)});
      }
    }
  }
  RecordProperty("worst_m", std::to_string(worst_m));
  EXPECT_LT(worst_m, 1e-4);
}

// Rays beside each other have the bits of the same rays one by one, in one layer or in several,
// also where one of them is none.
TEST(RayFan, TracesSeveralRaysAsOneByOne) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto rays =
      RayTracer::Make(Profile({0.0, 10.0, 12.0, 80.0}, {1520.0, 1519.0, 1490.0, 1487.0}));
  int traced = 0, refused = 0;
  for (int ping = 0; ping < 500; ++ping) {
    const double range_m = 3.0 + 60.0 * uniform(random);
    RayFan together(*rays, 1.0, 1515.0, 70.0), alone = together;
    RayFan::Launches launches;
    for (Eigen::Index k = 0; k < launches.sin.size(); ++k) {
      const double angle = Deg2Rad(75.0 * uniform(random));
      launches.sin[k] = std::sin(angle);
      launches.cos[k] = uniform(random) < 0.05 ? -1.0 : std::cos(angle);
      launches.one_way_s[k] = range_m * (0.9 + 0.2 * uniform(random)) / 1515.0;
    }
    const RayFan::Ends ends = together.Trace(launches);
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const auto end = alone.Trace(launches.sin[k], launches.cos[k], launches.one_way_s[k]);
      ASSERT_EQ(ends[i].has_value(), end.has_value());
      ++(end ? traced : refused);
      if (!end) continue;
      EXPECT_EQ(ends[i]->horizontal_m, end->horizontal_m);
      EXPECT_EQ(ends[i]->down_m, end->down_m);
    }
  }
  EXPECT_GT(traced, 1500);
  EXPECT_GT(refused, 20);
}

TEST(RayFan, RefusesWhatIsNoRay) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const RayTracer rays = RayTracer::Constant(1500.0);
  EXPECT_FALSE(RayFan(rays, nan, 1500.0, 50.0).Trace(0.5, 0.5, 0.1));
  EXPECT_FALSE(RayFan(rays, 0.0, nan, 50.0).Trace(0.5, 0.5, 0.1));
  EXPECT_TRUE(RayFan(rays, 0.0, 1500.0, nan).Trace(0.5, 0.5, 0.1));
  RayFan fan(rays, 0.0, 1500.0, 50.0);
  EXPECT_TRUE(fan.Trace(0.5, 0.5, 0.1));
  for (const double bad : {nan, inf, -0.1}) {
    EXPECT_FALSE(fan.Trace(bad, 0.5, 0.1));
    EXPECT_FALSE(fan.Trace(0.5, 0.5, bad));
  }
  EXPECT_FALSE(fan.Trace(0.5, -0.5, 0.1));
  EXPECT_FALSE(fan.Trace(1.0, 0.0, 0.1));
}

TEST(RayTracer, RefusesProfilesThatAreNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(RayTracer::Make(Profile({}, {})));
  EXPECT_FALSE(RayTracer::Make(Profile({0.0, 1.0}, {1500.0})));
  EXPECT_FALSE(RayTracer::Make(Profile({0.0, 0.0}, {1500.0, 1500.0})));
  EXPECT_FALSE(RayTracer::Make(Profile({1.0, 0.0}, {1500.0, 1500.0})));
  EXPECT_FALSE(RayTracer::Make(Profile({0.0, nan}, {1500.0, 1500.0})));
  EXPECT_FALSE(RayTracer::Make(Profile({0.0, 1.0}, {1500.0, nan})));
  EXPECT_FALSE(RayTracer::Make(Profile({0.0, 1.0}, {1500.0, 150.0})));
  EXPECT_TRUE(RayTracer::Make(Profile({5.0}, {1500.0})));
  EXPECT_THROW(RayTracer::Constant(0.0), std::invalid_argument);
}

}  // namespace
}  // namespace seastitch
