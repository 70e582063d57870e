#include "bench/terrain.hpp"

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <vector>

#include "bench/terrain_raster.hpp"
#include "tests/bench/bench_fixtures.hpp"
#include "tests/support/paths.hpp"

namespace seastitch::bench {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

ProceduralParams Rough() {
  ProceduralParams params;
  params.depth_m = 30.0;
  params.relief.rms_m = 1.5;
  params.relief.longest_m = 50.0;
  return params;
}

TEST(ProceduralTerrain, HasTheReliefAskedFor) {
  const ProceduralTerrain terrain(Rough(), 1);
  double sum = 0.0;
  double sum2 = 0.0;
  int n = 0;
  for (double north = -3000.0; north < 3000.0; north += 41.3) {
    for (double east = -3000.0; east < 3000.0; east += 41.3) {
      const double depth = *terrain.DepthAt(north, east);
      sum += depth;
      sum2 += depth * depth;
      ++n;
    }
  }
  const double mean = sum / n;
  EXPECT_NEAR(mean, 30.0, 0.1);
  EXPECT_NEAR(std::sqrt(sum2 / n - mean * mean), 1.5, 0.1);
}

TEST(ProceduralTerrain, DependsOnTheSeedAlone) {
  const ProceduralTerrain a(Rough(), 1);
  const ProceduralTerrain b(Rough(), 1);
  const ProceduralTerrain c(Rough(), 2);
  EXPECT_EQ(*a.DepthAt(12.3, -45.6), *b.DepthAt(12.3, -45.6));
  EXPECT_NE(*a.DepthAt(12.3, -45.6), *c.DepthAt(12.3, -45.6));
}

// The lattice's own lines would show as jumps of the slope.
TEST(ProceduralTerrain, HasNoCreases) {
  ProceduralParams params = Rough();
  params.relief.shortest_m = 5.0;
  const ProceduralTerrain terrain(params, 3);
  constexpr double kH = 1e-3;
  double last_slope = 0.0;
  for (double north = 0.0; north < 20.0; north += kH) {
    const double slope = (*terrain.DepthAt(north + kH, 7.0) - *terrain.DepthAt(north, 7.0)) / kH;
    if (north > 0.0) {
      EXPECT_LT(std::abs(slope - last_slope), 0.01) << north;
    }
    last_slope = slope;
  }
}

TEST(ProceduralTerrain, PipeStandsAsHighAsItIsThick) {
  ProceduralParams params;
  params.depth_m = 20.0;
  params.pipeline = {0.5, 10.0, 0.0, 90.0};
  const ProceduralTerrain terrain(params, 1);
  EXPECT_DOUBLE_EQ(*terrain.DepthAt(10.0, 123.0), 19.5);
  EXPECT_NEAR(*terrain.DepthAt(10.2, -50.0), 19.6, 1e-9);  // 3-4-5 of its radius
  EXPECT_EQ(*terrain.DepthAt(10.26, 0.0), 20.0);
}

TEST(ProceduralTerrain, FlatStripIsFlat) {
  ProceduralParams params = Rough();
  params.sand_waves.height_m = 1.0;
  params.flat_strip = {100.0, 150.0};
  const ProceduralTerrain terrain(params, 1);
  for (double east = 0.0; east < 50.0; east += 1.0) EXPECT_EQ(*terrain.DepthAt(125.0, east), 30.0);
  EXPECT_NE(*terrain.DepthAt(80.0, 1.0), 30.0);
}

TEST(ProceduralTerrain, SandWavesAreAsHighAndLongAsAskedFor) {
  ProceduralParams params;
  params.sand_waves = {1.0, 10.0, 0.0};
  const ProceduralTerrain terrain(params, 1);
  double lowest = 0.0;
  double highest = 100.0;
  int crossings = 0;
  double last = 0.0;
  for (double north = 0.0; north < 1000.0; north += 0.05) {
    const double height = params.depth_m - *terrain.DepthAt(north, 0.0);
    if (north > 0.0 && (height > 0.0) != (last > 0.0)) ++crossings;
    last = height;
    lowest = std::max(lowest, *terrain.DepthAt(north, 0.0));
    highest = std::min(highest, *terrain.DepthAt(north, 0.0));
  }
  EXPECT_NEAR(lowest - highest, 1.2, 0.4);
  EXPECT_NEAR(crossings / 2, 100, 15);
}

GridTerrain::Cells Plane(int rows, int cols) {
  GridTerrain::Cells cells{rows, cols, 2.0, 1.0, {}};
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col)
      cells.depth_m.push_back(static_cast<float>(10.0 + 0.5 * row + 0.25 * col));
  return cells;
}

TEST(GridTerrain, InterpolatesAPlaneExactly) {
  const GridTerrain terrain(Plane(20, 30), 0.0, {{0.0, 0.0}, {39.0, 29.0}});
  for (double north = 6.0; north < 34.0; north += 0.7) {
    for (double east = 4.0; east < 26.0; east += 0.3) {
      const double row = (north - terrain.corner().x()) / 2.0 - 0.5;
      const double col = (east - terrain.corner().y()) - 0.5;
      EXPECT_NEAR(*terrain.DepthAt(north, east), 10.0 + 0.5 * row + 0.25 * col, 1e-5);
    }
  }
}

TEST(GridTerrain, FillsSmallHolesAndKeepsLargeOnes) {
  GridTerrain::Cells cells{40, 40, 1.0, 1.0, std::vector<float>(1600, 12.0f)};
  cells.depth_m[5 * 40 + 5] = kUnknown;
  for (int row = 20; row < 35; ++row)
    for (int col = 20; col < 35; ++col) cells.depth_m[std::size_t(row * 40 + col)] = kUnknown;
  const GridTerrain terrain(cells, 2.0, {{0.0, 0.0}, {39.5, 39.5}});
  EXPECT_NEAR(*terrain.DepthAt(5.5, 5.5), 12.0, 1e-6);
  EXPECT_FALSE(terrain.DepthAt(27.5, 27.5));
  EXPECT_TRUE(terrain.DepthAt(20.5, 27.5));  // filled from the edge
  EXPECT_FALSE(terrain.DepthAt(-3.0, 5.0));  // off the grid
}

TEST(GridTerrain, LaysTheSurveyWhereTheSeabedIsKnown) {
  GridTerrain::Cells cells{50, 50, 1.0, 1.0, std::vector<float>(2500, kUnknown)};
  for (int row = 30; row < 45; ++row)
    for (int col = 5; col < 25; ++col) cells.depth_m[std::size_t(row * 50 + col)] = 9.0f;
  const GridTerrain terrain(cells, 0.0, {{-5.0, -8.0}, {7.0, 9.0}});
  for (double north = -5.0; north <= 7.0; north += 1.0)
    for (double east = -8.0; east <= 9.0; east += 1.0)
      EXPECT_TRUE(terrain.DepthAt(north, east)) << north << " " << east;
}

class RasterFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() /
            ("seastitch_raster_" +
             std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".tif");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  // 20 x 30 cells of 2 m: elevation -10 in the south-west, deeper by 0.1 a row to the north.
  void Write(const char* crs) {
    GDALAllRegister();
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    GDALDataset* dataset = driver->Create(path_.c_str(), 30, 20, 1, GDT_Float32, nullptr);
    double transform[6] = {357000.0, 2.0, 0.0, 4770000.0, 0.0, -2.0};
    dataset->SetGeoTransform(transform);
    OGRSpatialReference srs;
    srs.SetFromUserInput(crs);
    dataset->SetSpatialRef(&srs);
    dataset->GetRasterBand(1)->SetNoDataValue(-9999.0);
    std::vector<float> line(30);
    for (int row = 0; row < 20; ++row) {
      for (float& v : line) v = -10.0f - 0.1f * static_cast<float>(19 - row);
      if (row == 0) line.assign(30, -9999.0f);
      ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(
                    GF_Write, 0, row, 30, 1, line.data(), 30, 1, GDT_Float32, 0, 0),
                CE_None);
    }
    GDALClose(dataset);
  }

  std::string ReasonOfRefusal() const {
    try {
      LoadRaster({path_.string(), false, 0.0, 0.0, false}, {{0.0, 0.0}, {10.0, 10.0}});
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  }

  std::filesystem::path path_;
};

TEST_F(RasterFile, ElevationsBecomeDepthsWithNorthUp) {
  Write("EPSG:32619");
  const auto terrain =
      LoadRaster({path_.string(), false, 5.0, 0.0, false}, {{0.0, 0.0}, {30.0, 50.0}});
  const Eigen::Vector2d corner = terrain->corner();
  EXPECT_NEAR(*terrain->DepthAt(corner.x() + 1.0, corner.y() + 20.0), 15.0, 1e-4);
  EXPECT_NEAR(*terrain->DepthAt(corner.x() + 21.0, corner.y() + 20.0), 16.0, 1e-4);
  EXPECT_FALSE(terrain->DepthAt(corner.x() + 39.0, corner.y() + 20.0));  // no data
}

TEST_F(RasterFile, StandsAloneUnlessAnOverlayIsAskedFor) {
  Write("EPSG:32619");
  SurveyConfig config = ShortSurvey();
  config.plan.heading_deg = 0.0;
  config.plan.line_length_m = 5.0;
  config.plan.lead_in_m = 2.0;
  config.raster.file = path_.string();
  config.raster.depth_offset_m = 20.0;
  const auto depth_at_start = [&config] {
    const SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
    return *simulator.terrain().DepthAt(0.0, 0.0);
  };
  const double alone = depth_at_start();
  EXPECT_GE(alone, 30.0);
  EXPECT_LE(alone, 32.0);
  config.terrain.pipeline = {0.5, 0.0, 0.0, 0.0};
  EXPECT_EQ(depth_at_start(), alone);
  config.raster.overlay = true;
  config.terrain.relief.rms_m = 0.0;
  EXPECT_NEAR(depth_at_start(), alone - 0.5, 1e-9);
}

TEST_F(RasterFile, RefusesDegrees) {
  Write("EPSG:4326");
  EXPECT_NE(ReasonOfRefusal().find("metres"), std::string::npos);
}

TEST_F(RasterFile, WithoutWaterNamesTheKeyForDepths) {
  Write("EPSG:32619");
  EXPECT_THAT(
      [this] {
        LoadRaster({path_.string(), /*positive_down=*/true, 0.0, 0.0, false},
                   {{0.0, 0.0}, {10.0, 10.0}});
      },
      testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("positive_down")));
}

TEST_F(RasterFile, NamesAMissingFile) {
  EXPECT_NE(ReasonOfRefusal().find(path_.string()), std::string::npos);
}

TEST(Raster, RealHarbourHasAWindowForTheSurvey) {
  const std::string file = Shared("data/dem/sh2007_portsmouth_0p5m.tif");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "not there: " << file;
  const MapBox box{{-20.0, -20.0}, {180.0, 145.0}};
  const auto terrain = LoadRaster({file, false, 0.0, 4.0, false}, box);
  int known = 0;
  int all = 0;
  for (double north = box.min.x(); north <= box.max.x(); north += 2.0) {
    for (double east = box.min.y(); east <= box.max.y(); east += 2.0) {
      ++all;
      const auto depth = terrain->DepthAt(north, east);
      if (!depth) continue;
      ++known;
      EXPECT_GT(*depth, 9.0);
      EXPECT_LT(*depth, 20.0);
    }
  }
  EXPECT_GT(known, 0.97 * all);
}

}  // namespace
}  // namespace seastitch::bench
