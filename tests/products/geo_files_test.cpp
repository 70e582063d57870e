#include "products/geo_files.hpp"

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <memory>
#include <string>

#include "common/runtime/durable_file.hpp"
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

}  // namespace
}  // namespace seastitch
