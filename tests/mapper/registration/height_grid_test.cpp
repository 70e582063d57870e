#include "mapper/registration/height_grid.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mapper/registration/correlator.hpp"
#include "tests/mapper/registration/synthetic_pair.hpp"

namespace seastitch {
namespace {

PointCloud Sample(double noise_sigma, int points, double (*height)(double, double)) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-20.0, 20.0);
  std::normal_distribution<double> noise(0.0, 1.0);
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    const double x = unit(random);
    const double y = unit(random);
    cloud.Add(Eigen::Vector3d(x, y, height(x, y) + noise_sigma * noise(random)).cast<float>());
  }
  return cloud;
}

TEST(HeightPyramid, FollowsATiltedPlaneOnEveryLevelUpToItsRim) {
  const auto plane = [](double x, double y) { return 12.0 + 0.2 * x - 0.1 * y; };
  const RegistrationSubmap submap = RegistrationSubmap::Prepare(
      Sample(0.0, 4000, plane), Eigen::Matrix3d::Identity(), RegistrationParams());
  ASSERT_EQ(submap.levels().size(), 4u);
  EXPECT_NEAR(submap.height_datum_m(), 12.0, 0.2);
  for (const RegistrationSubmap::Level& level : submap.levels()) {
    int known = 0;
    const GridGeometry& g = level.grid.geometry();
    for (int row = 0; row < g.rows; ++row) {
      for (int col = 0; col < g.cols; ++col) {
        const RegistrationSubmap::Cell& cell = level.grid(row, col);
        if (cell.variance == 0.0f) continue;
        const Eigen::Vector2d p = g.Center(row, col);
        EXPECT_NEAR(cell.height_m + submap.height_datum_m(), plane(p.x(), p.y()), 1e-4);
        EXPECT_NEAR(cell.slope_x, 0.2, 1e-4);
        EXPECT_NEAR(cell.slope_y, -0.1, 1e-4);
        ++known;
      }
    }
    // All of the 40 m square but a rim of two cells.
    const double inner_m = 40.0 - 4.0 * level.cell_m();
    EXPECT_GT(known * level.cell_m() * level.cell_m(), inner_m * inner_m) << level.cell_m();
  }
}

TEST(HeightPyramid, MeasuresTheNoiseOfSoundingsOnASlope) {
  const auto slope = [](double x, double y) { return 0.3 * x + 0.002 * y * y; };
  for (const double sigma : {0.02, 0.05, 0.2}) {
    const RegistrationSubmap submap = RegistrationSubmap::Prepare(
        Sample(sigma, 6000, slope), Eigen::Matrix3d::Identity(), RegistrationParams());
    EXPECT_NEAR(submap.sounding_sigma_m(), sigma, 0.15 * sigma);
  }
}

TEST(HeightGrid, InterpolatesAQuadraticSurfaceExactly) {
  const auto height = [](double x, double y) {
    return 0.3 * x * x - 0.2 * x * y + 0.1 * y * y + y;
  };
  GridGeometry g;
  g.cell_m = 0.5;
  g.rows = 10;
  g.cols = 12;
  Grid<RegistrationSubmap::Cell> grid(g);
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      const Eigen::Vector2d p = g.Center(row, col);
      grid(row, col) = {static_cast<float>(height(p.x(), p.y())),
                        static_cast<float>(0.6 * p.x() - 0.2 * p.y()),
                        static_cast<float>(-0.2 * p.x() + 0.2 * p.y() + 1.0),
                        2.0f,
                        2.0f};
    }
  }
  CellsAround around;
  HeightSample sample;
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(1.1, 2.3), {3.33, 4.04}, {0.25, 5.7}}) {
    ASSERT_TRUE(Interpolate(grid, p, &around, &sample));
    EXPECT_NEAR(sample.height_m, height(p.x(), p.y()), 1e-5);
    EXPECT_NEAR(sample.slope.x(), 0.6 * p.x() - 0.2 * p.y(), 1e-5);
    EXPECT_NEAR(sample.variance, 2.0, 1e-6);
  }
  grid(4, 4).variance = 0.0f;
  EXPECT_FALSE(Interpolate(grid, g.Center(4, 4) + Eigen::Vector2d(0.1, 0.1), &around, &sample));
  EXPECT_FALSE(Interpolate(grid, {0.2, 2.0}, &around, &sample));
  EXPECT_FALSE(Interpolate(grid, {std::nan(""), 2.0}, &around, &sample));
}

TEST(Correlator, EqualsTheSumItStandsFor) {
  for (const int lag_rows : {1, 3, 8}) {
    Correlator correlator(6, 10, lag_rows);
    const auto rows = static_cast<std::size_t>(correlator.rows());
    const auto cols = static_cast<std::size_t>(correlator.cols());
    ASSERT_EQ(rows, 8u);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::vector<double> a(rows * cols);
    std::vector<double> b(rows * cols);
    for (double& v : a) v = unit(random);
    for (double& v : b) v = unit(random);
    const auto spectrum_a = correlator.Transform(a);
    const auto spectrum_b = correlator.Transform(b);
    const double* lags = correlator.Correlate(spectrum_a, spectrum_b);
    for (std::size_t i = 0; i < static_cast<std::size_t>(lag_rows); ++i) {
      for (std::size_t j = 0; j < cols; ++j) {
        double sum = 0.0;
        for (std::size_t r = 0; r < rows; ++r)
          for (std::size_t c = 0; c < cols; ++c)
            sum += a[r * cols + c] * b[(r + i) % rows * cols + (c + j) % cols];
        EXPECT_NEAR(lags[i * cols + j], sum, 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace seastitch
