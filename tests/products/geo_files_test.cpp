#include "products/files/geo_files.hpp"

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr Datum kDatum{57.1234, 11.5678};

GridGeometry SmallGrid() { return GridGeometry::Covering({-20, 100}, {30, 180}, 2.0); }

RasterBand Ramp(const GridGeometry& g) {
  RasterBand band{"mean depth", "m", {}};
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      band.values.push_back(row == 3 && col == 4 ? kNoData : static_cast<float>(100 * row + col));
    }
  }
  return band;
}

using Dataset = std::unique_ptr<GDALDataset, void (*)(GDALDataset*)>;

Dataset Open(const std::filesystem::path& path, unsigned int flags) {
  GDALAllRegister();
  return Dataset(
      static_cast<GDALDataset*>(GDALOpenEx(path.c_str(), flags, nullptr, nullptr, nullptr)),
      [](GDALDataset* d) { GDALClose(d); });
}

float Pixel(GDALRasterBand* band, int x, int y) {
  float value = 0;
  EXPECT_EQ(band->RasterIO(GF_Read, x, y, 1, 1, &value, 1, 1, GDT_Float32, 0, 0, nullptr), CE_None);
  return value;
}

TEST(GeoTiff, PutsAKnownLatitudeAndLongitudeIntoTheRightCell) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  WriteAtomically(folder / "a.tif", GeoTiff(g, {Ramp(g)}, kDatum));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  double to_pixel[6], to_map[6];
  ASSERT_EQ(tif->GetGeoTransform(to_map), CE_None);
  ASSERT_TRUE(GDALInvGeoTransform(to_map, to_pixel));

  OGRSpatialReference wgs84, projected(*tif->GetSpatialRef());
  wgs84.importFromEPSG(4326);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  projected.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> transform(
      OGRCreateCoordinateTransformation(&wgs84, &projected));
  ASSERT_NE(transform, nullptr);
  const GeographicLib::LocalCartesian local(kDatum.latitude_deg, kDatum.longitude_deg);
  for (const auto& [row, col] : std::vector<std::pair<int, int>>{{0, 0}, {7, 31}, {25, 40}}) {
    const Eigen::Vector2d center = g.Center(row, col);
    double latitude = 0, longitude = 0, height = 0;
    local.Reverse(center.y(), center.x(), 0.0, latitude, longitude, height);
    ASSERT_TRUE(transform->Transform(1, &longitude, &latitude));
    EXPECT_NEAR(longitude, center.y(), 1e-3);
    EXPECT_NEAR(latitude, center.x(), 1e-3);
    const double x = to_pixel[0] + to_pixel[1] * longitude + to_pixel[2] * latitude;
    const double y = to_pixel[3] + to_pixel[4] * longitude + to_pixel[5] * latitude;
    EXPECT_EQ(Pixel(tif->GetRasterBand(1), static_cast<int>(x), static_cast<int>(y)),
              static_cast<float>(100 * row + col));
  }
}

TEST(GeoTiff, IsTiledDeflatedFloatWithNamedBandsAndNoData) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  RasterBand second = Ramp(g);
  second.description = "spread";
  WriteAtomically(folder / "a.tif", GeoTiff(g, {Ramp(g), second}, kDatum));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  ASSERT_EQ(tif->GetRasterCount(), 2);
  GDALRasterBand* band = tif->GetRasterBand(1);
  EXPECT_EQ(band->GetRasterDataType(), GDT_Float32);
  EXPECT_STREQ(band->GetDescription(), "mean depth");
  EXPECT_STREQ(band->GetUnitType(), "m");
  EXPECT_STREQ(tif->GetRasterBand(2)->GetDescription(), "spread");
  EXPECT_EQ(band->GetNoDataValue(), static_cast<double>(kNoData));
  EXPECT_EQ(Pixel(band, 4, g.rows - 1 - 3), kNoData);
  EXPECT_STREQ(tif->GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE"), "DEFLATE");
  int width = 0, height = 0;
  band->GetBlockSize(&width, &height);
  EXPECT_EQ(width, 256);
  EXPECT_EQ(height, 256);
}

TEST(GeoTiff, HasLocalMetresButNoProjectionWithoutADatum) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  WriteAtomically(folder / "a.tif", GeoTiff(g, {Ramp(g)}, std::nullopt));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  EXPECT_EQ(tif->GetSpatialRef(), nullptr);
  double to_map[6];
  ASSERT_EQ(tif->GetGeoTransform(to_map), CE_None);
  EXPECT_EQ(to_map[0], 100.0);
  EXPECT_EQ(to_map[3], 32.0);  // upper edge of the highest row
  EXPECT_EQ(to_map[5], -2.0);
}

TEST(GeoTiff, IsTheSameBytesEveryTimeAndHoldsNoTime) {
  const GridGeometry g = SmallGrid();
  const std::string bytes = GeoTiff(g, {Ramp(g)}, kDatum);
  EXPECT_EQ(bytes, GeoTiff(g, {Ramp(g)}, kDatum));
  const TemporaryDir folder;
  WriteAtomically(folder / "a.tif", bytes);
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  EXPECT_EQ(tif->GetMetadataItem("TIFFTAG_DATETIME"), nullptr);
}

TEST(GeoPackage, HoldsEveryLayerAndFieldAndTheSameBytesEveryTime) {
  const TemporaryDir folder;
  VectorLayer areas{"footprints", true, {}};
  areas.features.push_back(
      {{{0, 0}, {0, 4}, {3, 4}, {3, 0}}, {{"submap", 7.0}, {"closed_by", std::string("turn")}}});
  VectorLayer lines{"edges", false, {}};
  lines.features.push_back({{{0, 0}, {10, 20}}, {{"weight", std::nan("")}}});
  const std::string bytes = GeoPackage({areas, lines}, kDatum);
  EXPECT_EQ(bytes, GeoPackage({areas, lines}, kDatum));
  WriteAtomically(folder / "a.gpkg", bytes);
  const Dataset gpkg = Open(folder / "a.gpkg", GDAL_OF_VECTOR);
  ASSERT_NE(gpkg, nullptr);
  ASSERT_EQ(gpkg->GetLayerCount(), 2);
  OGRLayer* footprints = gpkg->GetLayerByName("footprints");
  ASSERT_NE(footprints, nullptr);
  const std::unique_ptr<OGRFeature> area(footprints->GetNextFeature());
  EXPECT_EQ(area->GetFieldAsDouble("submap"), 7.0);
  EXPECT_STREQ(area->GetFieldAsString("closed_by"), "turn");
  EXPECT_EQ(area->GetGeometryRef()->toPolygon()->get_Area(), 12.0);
  const std::unique_ptr<OGRFeature> line(gpkg->GetLayerByName("edges")->GetNextFeature());
  EXPECT_FALSE(line->IsFieldSetAndNotNull(0));
  EXPECT_EQ(line->GetGeometryRef()->toLineString()->getX(1), 20.0);  // east
  EXPECT_EQ(line->GetGeometryRef()->toLineString()->getY(1), 10.0);  // north
}

// Against GeographicLib, over a zone and beyond.
TEST(GeographicConverter, UtmIsThatOfGeographicLib) {
  const GeographicConverter grid("EPSG:32632");
  EXPECT_EQ(grid.name(), "WGS 84 / UTM zone 32N");
  EXPECT_EQ(grid.z_unit_m(), 1.0);
  EXPECT_FALSE(grid.z_is_down());
  for (const double latitude : {1.0, 57.1, 80.0})
    for (const double longitude : {5.0, 9.0, 12.5}) {
      int zone = 0;
      bool north = false;
      double x = 0.0, y = 0.0;
      GeographicLib::UTMUPS::Forward(latitude, longitude, zone, north, x, y, 32);
      std::vector<Eigen::Vector2d> p{{x, y}};
      grid.Convert(&p);
      EXPECT_NEAR(Rad2Deg(p[0].x()), latitude, 1e-9);
      EXPECT_NEAR(Rad2Deg(p[0].y()), longitude, 1e-9);
    }
}

// East comes first whatever the order of axes of the system, and the vertical system has its own
// unit and direction.
TEST(GeographicConverter, AxesAndUnitsOfTheSystem) {
  std::vector<Eigen::Vector2d> p{{11.2, 57.1}};
  GeographicConverter("EPSG:4326").Convert(&p);
  EXPECT_NEAR(Rad2Deg(p[0].x()), 57.1, 1e-12);
  EXPECT_NEAR(GeographicConverter("EPSG:2263").z_unit_m(), 1200.0 / 3937.0, 1e-9);  // feet
  EXPECT_EQ(GeographicConverter("EPSG:2263+5703").z_unit_m(), 1.0);
  EXPECT_NEAR(GeographicConverter("EPSG:32618+6360").z_unit_m(), 1200.0 / 3937.0, 1e-9);
  EXPECT_TRUE(GeographicConverter("EPSG:32632+5715").z_is_down());  // depth
  EXPECT_FALSE(GeographicConverter("EPSG:32632+5714").z_is_down());
  EXPECT_NEAR(GeographicConverter(ProjectionWkt(kDatum)).z_unit_m(), 1.0, 1e-12);
}

TEST(GeographicConverter, WhatCannotBeConvertedIsNamed) {
  EXPECT_THROW(GeographicConverter("EPSG:1"), std::runtime_error);
  EXPECT_THROW(GeographicConverter("chart datum"), std::runtime_error);
  std::vector<Eigen::Vector2d> p{{1e9, 1e9}, {500'000.0, 6'300'000.0}};
  GeographicConverter("EPSG:32632").Convert(&p);
  EXPECT_FALSE(p[0].allFinite());
  EXPECT_TRUE(p[1].allFinite());
}

}  // namespace
}  // namespace seastitch
