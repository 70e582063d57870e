#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "mapper/registration/registration.hpp"
#include "mapper/registration/smoothing.hpp"

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;
using Level = RegistrationSubmap::Level;

constexpr double kLengthM = 60.0;
constexpr double kWidthM = 40.0;
constexpr int kPoints = 10'000;

std::vector<Eigen::Vector2d> Places(std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < kPoints; ++i) {
    const double y = kWidthM * unit(*random);  // before x, on every processor
    places.emplace_back(kLengthM * unit(*random), y);
  }
  return places;
}

// Soundings there on a seabed 20 m below, and their noise.
RegistrationSubmap Sounded(const std::vector<Eigen::Vector2d>& places,
                           const std::function<double(const Eigen::Vector2d&)>& sigma_m,
                           std::mt19937_64* random,
                           const std::function<double(const Eigen::Vector2d&)>& relief_m = {}) {
  std::normal_distribution<double> noise(0.0, 1.0);
  PointCloud cloud;
  for (const Eigen::Vector2d& p : places) {
    const double z = 20.0 + (relief_m ? relief_m(p) : 0.0) + sigma_m(p) * noise(*random);
    cloud.Add(Eigen::Vector3d(p.x(), p.y(), z).cast<float>());
  }
  return RegistrationSubmap::Prepare(cloud, Eigen::Matrix3d::Identity(), {});
}

// The known cells between two distances from the middle line, of the finest level.
template <class Visit>
void ForCellsAcross(const RegistrationSubmap& submap, double from_m, double to_m, Visit visit) {
  const Grid<Cell>& grid = submap.levels().front().grid;
  for (int row = 0; row < grid.geometry().rows; ++row) {
    for (int col = 0; col < grid.geometry().cols; ++col) {
      const double across = std::abs(grid.geometry().Center(row, col).y());
      if (across >= from_m && across < to_m && grid(row, col).variance > 0.0f)
        visit(row, col, grid(row, col));
    }
  }
}

double MeanNoise(const RegistrationSubmap& submap, double from_m, double to_m) {
  double sum = 0.0;
  int count = 0;
  ForCellsAcross(submap, from_m, to_m, [&](int, int, const Cell& cell) {
    sum += cell.noise;
    ++count;
  });
  return sum / count;
}

double Swath(const Eigen::Vector2d& p) { return 0.02 + 0.1 * std::pow(p.y() / 20.0, 2); }

TEST(LocalNoise, IsOneWhereItIsTheSameEverywhere) {
  std::mt19937_64 random(1);
  const auto submap = Sounded(
      Places(&random), [](const auto&) { return 0.05; }, &random);
  EXPECT_NEAR(MeanNoise(submap, 0.0, 5.0), 1.0, 0.1);
  EXPECT_NEAR(MeanNoise(submap, 15.0, 20.0), 1.0, 0.1);
}

TEST(LocalNoise, FollowsThatOfTheBeams) {
  std::mt19937_64 random(2);
  const auto submap = Sounded(Places(&random), Swath, &random);
  const auto expected = [&](double across_m) {
    return std::pow(Swath({0.0, across_m}) / submap.sounding_sigma_m(), 2);
  };
  for (const double across_m : {1.0, 6.0, 12.0, 16.0})
    EXPECT_NEAR(MeanNoise(submap, across_m - 1.0, across_m + 1.0) / expected(across_m), 1.0, 0.25)
        << across_m;
}

TEST(LocalNoise, IsNotWhatAPipeShows) {
  std::mt19937_64 random(3);
  const auto pipe = [](const Eigen::Vector2d& p) { return std::abs(p.y()) < 0.3 ? -0.5 : 0.0; };
  const auto submap = Sounded(
      Places(&random), [](const auto&) { return 0.05; }, &random, pipe);
  float scatter = 0.0f;
  ForCellsAcross(submap, 0.0, 0.5, [&](int, int, const Cell& cell) {
    scatter = std::max(scatter, cell.scatter);
  });
  EXPECT_GT(scatter, 10.0 * 0.05 * 0.05) << "the pipe shows";
  EXPECT_LT(MeanNoise(submap, 0.0, 1.0), 2.5);
}

// Boulders of half a metre on one half of a seabed that is smooth else, the noise the same.
TEST(LocalNoise, OfABoulderFieldIsBoundedAndLeavesTheSmoothHalfItsOwn) {
  std::mt19937_64 random(5);
  const auto boulders = [](const Eigen::Vector2d& p) {
    return p.y() > 0.0 ? 0.4 * std::sin(2.0 * p.x()) * std::sin(2.0 * p.y()) : 0.0;
  };
  const auto submap = Sounded(
      Places(&random), [](const auto&) { return 0.03; }, &random, boulders);
  for (const Level& level : submap.levels()) {
    const GridGeometry& g = level.grid.geometry();
    for (int row = 0; row < g.rows; ++row) {
      for (int col = 0; col < g.cols; ++col) {
        const Cell& cell = level.grid(row, col);
        if (!(cell.variance > 0.0f)) continue;
        EXPECT_LE(cell.noise, 16.0f);
        if (g.Center(row, col).y() > -5.0) continue;
        // As on every level: the noise is the soundings', whatever the size of the cells.
        const double variance = cell.noise * std::pow(submap.sounding_sigma_m(), 2);
        EXPECT_GT(variance, 0.3 * 0.03 * 0.03) << level.number;
        EXPECT_LT(variance, 3.0 * 0.03 * 0.03) << level.number;
      }
    }
  }
}

// Turned, so that blocks at the rim are slivers of which next to no cell is known.
TEST(LocalNoise, IsKnownOfEveryCellAtTheRim) {
  std::mt19937_64 random(6);
  std::vector<Eigen::Vector2d> places = Places(&random);
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(0.4).toRotationMatrix();
  for (Eigen::Vector2d& p : places) p = R * p;
  const auto submap = Sounded(
      places, [&R](const Eigen::Vector2d& p) { return Swath(R.transpose() * p); }, &random);
  int known = 0;
  int typical = 0;
  for (const Cell& cell : submap.levels().front().grid.cells()) {
    known += cell.variance > 0.0f;
    typical += cell.variance > 0.0f && cell.noise == 1.0f;
  }
  EXPECT_GT(known, 5000);
  EXPECT_LT(typical, known / 1000);
}

// What noise makes of height times slope, and of height squared, over draws of the same soundings.
TEST(LocalNoise, ErrorsOfHeightAndSlopeGoTogetherAsTheCellsSay) {
  std::mt19937_64 random(4);
  const std::vector<Eigen::Vector2d> places = Places(&random);
  struct Band {
    double from_m;
    double to_m;
    double variance = 0.0;    // seen
    double covariance = 0.0;  // of height and outward slope
    double said_variance = 0.0;
    double said_covariance = 0.0;
  };
  std::vector<Band> bands{{4.0, 8.0}, {9.0, 13.0}, {13.0, 17.0}, {19.0, 20.5}};
  for (int draw = 0; draw < 100; ++draw) {
    const RegistrationSubmap submap = Sounded(places, Swath, &random);
    const double unit = std::pow(submap.sounding_sigma_m(), 2) / SmoothingKernel().PatchCells();
    const Grid<Cell>& grid = submap.levels().front().grid;
    for (Band& band : bands) {
      ForCellsAcross(submap, band.from_m, band.to_m, [&](int row, int col, const Cell& cell) {
        const double outward = grid.geometry().Center(row, col).y() > 0.0 ? 1.0 : -1.0;
        const double error = cell.height_m - (20.0 - submap.height_datum_m());
        band.variance += error * error;
        band.covariance += error * outward * cell.slope_y;
        band.said_variance += unit * cell.variance;
        band.said_covariance += unit * outward * cell.covariance_y;
      });
    }
  }
  for (const Band& band : bands) {
    EXPECT_NEAR(band.said_variance / band.variance, 1.0, 0.25) << band.from_m;
    EXPECT_NEAR(band.said_covariance / band.covariance, 1.0, 0.25) << band.from_m;
  }
}

}  // namespace
}  // namespace seastitch
