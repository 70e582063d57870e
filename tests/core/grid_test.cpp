#include "common/core/grid.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace seastitch {
namespace {

TEST(GridGeometry, CoversBothCornersWithCellsOnMultiples) {
  const GridGeometry g = GridGeometry::Covering({-3.2, 0.0}, {4.0, 1.99}, 0.5);
  EXPECT_EQ(g.origin, Eigen::Vector2d(-3.5, 0.0));
  EXPECT_EQ(g.rows, 16);
  EXPECT_EQ(g.cols, 4);
  EXPECT_TRUE(g.Contains(g.Row(-3.2), g.Col(0.0)));
  EXPECT_TRUE(g.Contains(g.Row(4.0), g.Col(1.99)));
  EXPECT_FALSE(g.Contains(g.Row(4.5), g.Col(1.0)));
  EXPECT_FALSE(g.Contains(g.Row(0.0), g.Col(-0.01)));
}

TEST(GridGeometry, FindsEveryCellByItsCenter) {
  const GridGeometry g = GridGeometry::Covering({-1.0, -1.0}, {1.0, 2.0}, 0.3);
  for (int row = 0; row < g.rows; ++row)
    for (int col = 0; col < g.cols; ++col) {
      const Eigen::Vector2d center = g.Center(row, col);
      EXPECT_EQ(g.Row(center.x()), row);
      EXPECT_EQ(g.Col(center.y()), col);
      EXPECT_LT(g.Index(row, col), g.size());
    }
}

TEST(GridGeometry, WildPlacesAreInNoCell) {
  const GridGeometry g = GridGeometry::Covering({0.0, 0.0}, {9.5, 9.5}, 1.0);
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const double wild : {std::numeric_limits<double>::quiet_NaN(),
                            kInf,
                            -kInf,
                            1e300,
                            -1e300,
                            3e9,
                            -3e9,
                            10.0,
                            -0.001}) {
    EXPECT_FALSE(g.Contains(g.Row(wild), 0)) << wild;
    EXPECT_FALSE(g.Contains(0, g.Col(wild))) << wild;
  }
}

TEST(GridGeometry, CoversASinglePointWithOneCell) {
  EXPECT_EQ(GridGeometry::Covering({2.0, 3.0}, {2.0, 3.0}, 1.0).size(), 1u);
}

TEST(GridGeometry, RefusesToBecomeAWildAllocation) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d zero(0.0, 0.0);
  EXPECT_THROW(GridGeometry::Covering(zero, {1e7, 1e7}, 0.1), std::length_error);
  EXPECT_THROW(GridGeometry::Covering(zero, {kNan, 1.0}, 1.0), std::length_error);
  EXPECT_THROW(GridGeometry::Covering(zero, {kInf, 1.0}, 1.0), std::length_error);
  EXPECT_THROW(GridGeometry::Covering({5.0, 0.0}, zero, 1.0), std::length_error);
  EXPECT_THROW(GridGeometry::Covering(zero, {1.0, 1.0}, 0.0), std::length_error);
  EXPECT_THROW(GridGeometry::Covering(zero, {1.0, 1.0}, -1.0), std::length_error);
  EXPECT_THROW(GridGeometry::Covering(zero, {9.5, 9.5}, 1.0, 99), std::length_error);
  EXPECT_EQ(GridGeometry::Covering(zero, {9.5, 9.5}, 1.0, 100).size(), 100u);
}

// rows and cols are int: a long thin strip must not wrap around.
TEST(GridGeometry, RefusesAStripLongerThanAnIntCounts) {
  EXPECT_THROW(GridGeometry::Covering({0.0, 0.0}, {5e9, 0.0}, 1.0, 10'000'000'000),
               std::length_error);
}

}  // namespace
}  // namespace seastitch
