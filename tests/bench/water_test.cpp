#include "bench/water.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch::bench {
namespace {

class Plain : public Terrain {
 public:
  explicit Plain(double depth_m) : depth_m_(depth_m) {}
  std::optional<double> DepthAt(double, double) const override { return depth_m_; }

 private:
  double depth_m_;
};

// A wall of unknown seabed from east 5 m on.
class HalfKnown : public Terrain {
 public:
  std::optional<double> DepthAt(double, double east_m) const override {
    if (east_m > 5.0) return std::nullopt;
    return 20.0;
  }
};

Eigen::Vector3d Direction(double off_vertical_rad, double azimuth_rad) {
  return {std::sin(off_vertical_rad) * std::cos(azimuth_rad),
          std::sin(off_vertical_rad) * std::sin(azimuth_rad),
          std::cos(off_vertical_rad)};
}

TEST(Water, RaysOfOneSpeedAreStraight) {
  const Water water({{0.0}, {1500.0}});
  const Plain seabed(20.0);
  for (double angle = 0.0; angle < 80.0; angle += 7.3) {
    const auto echo =
        water.March(seabed, {3.0, -4.0, 8.0}, Direction(Deg2Rad(angle), Deg2Rad(100.0)), 200.0);
    ASSERT_TRUE(echo) << angle;
    const double range = 12.0 / std::cos(Deg2Rad(angle));
    EXPECT_NEAR(echo->one_way_s, range / 1500.0, 1e-9);
    const double across = 12.0 * std::tan(Deg2Rad(angle));
    EXPECT_NEAR(echo->p_map.x(), 3.0 + across * std::cos(Deg2Rad(100.0)), 1e-5);
    EXPECT_NEAR(echo->p_map.y(), -4.0 + across * std::sin(Deg2Rad(100.0)), 1e-5);
    EXPECT_NEAR(echo->p_map.z(), 20.0, 2e-6);
  }
}

// Even gradient: an arc of a circle whose horizontal way and time are known in closed form.
TEST(Water, RaysInAnEvenGradientAreArcs) {
  constexpr double kGradient = -1.2;  // per second: a strong thermocline
  const Water water({{0.0, 50.0}, {1510.0, 1510.0 + 50.0 * kGradient}});
  const Plain seabed(30.0);
  const double c0 = 1510.0 + 5.0 * kGradient;
  const double c1 = 1510.0 + 30.0 * kGradient;
  for (const double angle : {1.0, 20.0, 45.0, 65.0, 75.0}) {
    const double snell = std::sin(Deg2Rad(angle)) / c0;
    const double cos0 = std::cos(Deg2Rad(angle));
    const double cos1 = std::sqrt(1.0 - snell * snell * c1 * c1);
    const double across = (cos0 - cos1) / (snell * kGradient);
    const double time = std::log(c1 / c0 * (1.0 + cos0) / (1.0 + cos1)) / kGradient;
    const auto echo = water.March(seabed, {0.0, 0.0, 5.0}, Direction(Deg2Rad(angle), 0.0), 300.0);
    ASSERT_TRUE(echo) << angle;
    EXPECT_NEAR(echo->p_map.x(), across, 1e-4) << angle;
    EXPECT_NEAR(echo->one_way_s, time, 1e-7) << angle;
    EXPECT_GT(std::abs(across - 25.0 * std::tan(Deg2Rad(angle))), angle > 10.0 ? 0.02 : 0.0);
  }
}

TEST(Water, TheWayBackIsTheWayDown) {
  const Water water({{0.0, 8.0, 12.0, 40.0}, {1510.0, 1508.0, 1492.0, 1489.0}});
  const Plain seabed(25.0);
  const Eigen::Vector3d sonar(1.0, 2.0, 6.0);
  const Eigen::Vector3d direction = Direction(Deg2Rad(62.0), Deg2Rad(-40.0));
  const auto echo = water.March(seabed, sonar, direction, 100.0);
  ASSERT_TRUE(echo);
  const auto back = water.Back(echo->p_map, sonar, 0.5 * echo->snell_s_per_m);
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->one_way_s, echo->one_way_s, 2e-8);  // 30 um: the steps lie elsewhere
  EXPECT_NEAR((back->towards - direction).norm(), 0.0, 1e-6);
}

// Against rays in steps of 2 mm that ask the seabed at each.
TEST(Water, FindsTheFirstSeabedOnTheWay) {
  ProceduralParams params;
  params.depth_m = 20.0;
  params.relief.rms_m = 0.6;
  params.relief.longest_m = 30.0;
  params.relief.shortest_m = 1.0;
  params.pipeline = {0.5, 6.0, 0.0, 80.0};
  const ProceduralTerrain terrain(params, 5);
  const Water water({{0.0}, {1500.0}});
  const Eigen::Vector3d sonar(0.0, 0.0, 9.0);
  for (double angle = -68.0; angle <= 68.0; angle += 1.7) {
    const Eigen::Vector3d direction = Direction(Deg2Rad(std::abs(angle)), angle < 0 ? kPi : 0.1);
    const auto echo = water.March(terrain, sonar, direction, 100.0);
    ASSERT_TRUE(echo) << angle;
    double range = 0.0;
    for (Eigen::Vector3d p = sonar; *terrain.DepthAt(p.x(), p.y()) > p.z(); range += 0.002)
      p = sonar + range * direction;
    EXPECT_NEAR(echo->one_way_s * 1500.0, range, 0.005) << angle;
  }
}

TEST(Water, GivesNoEchoWhereThereIsNone) {
  const Water water({{0.0, 20.0}, {1490.0, 1520.0}});
  const Plain seabed(40.0);
  const Eigen::Vector3d sonar(0.0, 0.0, 2.0);
  EXPECT_FALSE(water.March(seabed, sonar, {0.0, 0.0, -1.0}, 100.0));                // upward
  EXPECT_FALSE(water.March(seabed, sonar, Direction(Deg2Rad(83.0), 0.0), 1000.0));  // turns up
  EXPECT_FALSE(water.March(seabed, sonar, Direction(Deg2Rad(60.0), 0.0), 30.0));    // too far
  EXPECT_FALSE(water.March(seabed, {0.0, 0.0, 41.0}, {0.0, 0.0, 1.0}, 100.0));      // in the seabed
  const HalfKnown half;
  EXPECT_TRUE(water.March(half, sonar, Direction(Deg2Rad(50.0), -kPi / 2.0), 100.0));
  EXPECT_FALSE(water.March(half, sonar, Direction(Deg2Rad(50.0), kPi / 2.0), 100.0));
}

}  // namespace
}  // namespace seastitch::bench
