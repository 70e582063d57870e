#include "mapper/submaps/footprint.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "common/core/pose.hpp"
#include "mapper/submaps/level_cloud.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

using Shape = std::function<bool(double, double)>;

PointCloud Fill(const Shape& shape, double per_m2, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> side(-50.0, 50.0);
  PointCloud cloud;
  for (int i = 0; i < static_cast<int>(10'000.0 * per_m2); ++i) {
    const double x = side(random);
    const double y = side(random);
    if (shape(x, y)) cloud.Add(Eigen::Vector3d(x, y, 10.0).cast<float>());
  }
  return cloud;
}

bool Inside(const Footprint& outline, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
    if ((a.y() > y) == (b.y() > y)) continue;
    if (x < a.x() + (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside;
}

double PartInside(const PointCloud& cloud, const Footprint& outline) {
  int inside = 0;
  for (const Eigen::Vector3f& p : cloud.points) {
    inside += Inside(outline, static_cast<double>(p.x()), static_cast<double>(p.y())) ? 1 : 0;
  }
  return inside / static_cast<double>(cloud.size());
}

bool Swath(double x, double y) { return std::abs(x) < 45.0 && std::abs(y) < 12.0; }
bool Bend(double x, double y) {  // a quarter of a ring: its hull is nearly twice as large
  const double r = std::hypot(x + 50.0, y + 50.0);
  return r > 60.0 && r < 80.0;
}

TEST(Footprint, CoversThePointsAndLittleElse) {
  for (const auto& [shape, area_m2] : {std::pair<Shape, double>{Swath, 2160.0}, {Bend, 2199.1}}) {
    for (const double per_m2 : {1.0, 10.0}) {
      const PointCloud cloud = Fill(shape, per_m2, 11);
      const Footprint outline = FootprintOf(LevelCloud(cloud, Eigen::Matrix3d::Identity()));
      EXPECT_GE(PartInside(cloud, outline), 0.95);
      EXPECT_GT(Area(outline), 0.93 * area_m2);
      EXPECT_LT(Area(outline), (per_m2 > 5.0 ? 1.15 : 1.35) * area_m2);
      EXPECT_LE(outline.size(), kMaxOutlineCorners);
    }
  }
}

TEST(Footprint, CoversRandomBlobs) {
  EXPECT_TRUE(rc::check([] {
    const int n = *rc::gen::inRange(1, 5);
    std::vector<Eigen::Vector3d> discs;
    for (int i = 0; i < n; ++i) {
      discs.emplace_back(
          *rc::gen::inRange(-30, 30), *rc::gen::inRange(-30, 30), *rc::gen::inRange(12, 20));
      // One piece: each disc holds the centre of the first or is held by it.
      discs.back().head<2>() *= i == 0 ? 1.0 : 0.0;
      if (i > 0) discs.back().head<2>() = discs[0].head<2>() + Eigen::Vector2d(8.0 * i, -6.0 * i);
    }
    const PointCloud cloud = Fill(
        [&](double x, double y) {
          for (const Eigen::Vector3d& d : discs) {
            if (std::hypot(x - d.x(), y - d.y()) < d.z()) return true;
          }
          return false;
        },
        2.0,
        *rc::gen::arbitrary<std::uint64_t>());
    RC_PRE(cloud.size() > 300u);
    const Footprint outline = FootprintOf(LevelCloud(cloud, Eigen::Matrix3d::Identity()));
    RC_ASSERT(PartInside(cloud, outline) >= 0.95);
    RC_ASSERT(outline.size() <= kMaxOutlineCorners);
  }));
}

TEST(Footprint, StandsInTheLevelFrame) {
  PointCloud tilted;
  const Eigen::Matrix3d R_level_submap = RotationFromRpy(0.3, -0.2, 0.0);
  for (const Eigen::Vector3f& p : Fill(Swath, 5.0, 3).points) {
    tilted.Add((R_level_submap.transpose() * p.cast<double>()).cast<float>());
  }
  EXPECT_NEAR(Area(FootprintOf(LevelCloud(tilted, R_level_submap))), 2160.0, 250.0);
}

TEST(Footprint, IsNotStretchedByAWildPoint) {
  PointCloud cloud = Fill(Swath, 5.0, 3);
  cloud.Add({1e6f, -1e6f, 0.0f});
  cloud.Add({std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f});
  EXPECT_NEAR(Area(FootprintOf(LevelCloud(cloud, Eigen::Matrix3d::Identity()))), 2160.0, 250.0);
}

TEST(Footprint, IsEmptyWithoutAnArea) {
  PointCloud cloud;
  EXPECT_TRUE(FootprintOf(LevelCloud(cloud, Eigen::Matrix3d::Identity())).empty());
  cloud.Add({1.0f, 2.0f, 3.0f});
  EXPECT_TRUE(FootprintOf(LevelCloud(cloud, Eigen::Matrix3d::Identity())).empty());
}

}  // namespace
}  // namespace seastitch
