#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <chrono>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/core/pose.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "products/geo/geo_package.hpp"
#include "products/geo/geographic_converter.hpp"
#include "products/geo/map_projection.hpp"
#include "products/geo/raster.hpp"
#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

constexpr Datum kDatum{57.1234, 11.5678};

GridGeometry SmallGrid() { return GridGeometry::Covering({-20, 100}, {30, 180}, 2.0); }

Raster Ramp(const GridGeometry& g) {
  Raster raster;
  raster.description = "elevation";
  raster.unit = "m";
  raster.is_vertical = true;
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      raster.values.push_back(row == 3 && col == 4 ? kNoData : static_cast<float>(100 * row + col));
    }
  }
  return raster;
}

MapProjection Utm(int vertical_epsg = 0) {
  return MapProjection(kDatum, Eigen::Vector2d::Zero(), "", vertical_epsg);
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

// Against GeographicLib: where a zone ends, south of the equator, in the exceptions of Norway and
// Svalbard, and beyond UTM.
TEST(MapProjection, ZoneAndPlaceAreThoseOfGeographicLib) {
  struct Place {
    const char* crs;
    Datum origin;
  };
  for (const Place& place : {Place{"EPSG:32632", {57.1, 11.99}},
                             Place{"EPSG:32633", {57.1, 12.01}},
                             Place{"EPSG:32619", {43.07, -70.71}},
                             Place{"EPSG:32719", {-0.01, -70.71}},
                             Place{"EPSG:32632", {60.4, 4.9}},   // Bergen: 32V
                             Place{"EPSG:32633", {78.2, 15.6}},  // Svalbard: 33X
                             Place{"EPSG:32601", {10.0, -179.9}},
                             Place{"EPSG:32660", {10.0, 179.9}},
                             Place{"EPSG:32661", {85.5, 30.0}},
                             Place{"EPSG:32761", {-82.0, -120.0}}}) {
    const MapProjection projection(place.origin, Eigen::Vector2d::Zero(), "", 0);
    EXPECT_EQ(projection.horizontal(), place.crs);
    const GeographicLib::LocalCartesian map(place.origin.latitude_deg, place.origin.longitude_deg);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0),
                                     Eigen::Vector3d(1500, -2300, 800),
                                     Eigen::Vector3d(-9000, 12'000, 5000)}) {
      double latitude = 0, longitude = 0, height = 0, x = 0, y = 0;
      map.Reverse(p.y(), p.x(), -p.z(), latitude, longitude, height);
      int zone = 0;
      bool north = false;
      const int own = std::stoi(std::string(place.crs).substr(8));
      GeographicLib::UTMUPS::Forward(latitude, longitude, zone, north, x, y, own == 61 ? 0 : own);
      if (place.origin.latitude_deg < 0.0 && north) y += 1e7;  // false northing of the south
      const Eigen::Vector2d at = projection.NorthEast(p);
      EXPECT_NEAR(at.x(), y, 1e-4) << place.crs << " " << p.transpose();
      EXPECT_NEAR(at.y(), x, 1e-4) << place.crs << " " << p.transpose();
    }
  }
}

TEST(MapProjection, TheZoneIsThatOfTheSurveysMiddle) {
  const Datum origin{57.1, 11.99};  // 12 degrees east lie 600 m from here
  EXPECT_EQ(MapProjection(origin, {0.0, -5000.0}, "", 0).horizontal(), "EPSG:32632");
  EXPECT_EQ(MapProjection(origin, {0.0, 5000.0}, "", 0).horizontal(), "EPSG:32633");
}

TEST(MapProjection, ManyPointsAtOnceLieWhereEachLiesAlone) {
  std::mt19937 random(3);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / 4294967295.0;
  };
  for (const Datum& origin : {kDatum, Datum{82.0, 17.9}, Datum{-33.0, 151.2}}) {
    const MapProjection projection(origin, Eigen::Vector2d::Zero(), "", 0);
    // In deep water, far from the map's origin.
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 200; ++i)
      points.emplace_back(
          65'000.0 + uniform(0.0, 4999.0), -40'000.0 + uniform(0.0, 4999.0), uniform(5000, 6000));
    const std::vector<Eigen::Vector2d> together = projection.NorthEast(points);
    double worst_m = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i)
      worst_m = std::max(worst_m, (together[i] - projection.NorthEast(points[i])).norm());
    EXPECT_LT(worst_m, 1e-3) << origin.latitude_deg;
  }
}

TEST(MapProjection, WithoutACrsPointsStayWhereTheyAre) {
  const MapProjection map;
  EXPECT_FALSE(map.has_crs());
  EXPECT_EQ(map.Wkt(), "");
  EXPECT_EQ(map.NorthEast(Eigen::Vector3d(1, 2, 3)), Eigen::Vector2d(1, 2));
}

TEST(MapProjection, TakesACrsInMetresAndNamesAnother) {
  const MapProjection etrs89(kDatum, Eigen::Vector2d::Zero(), "EPSG:25832", 0);
  EXPECT_LT((etrs89.NorthEast(Eigen::Vector3d(100, 50, 20)) -
             Utm().NorthEast(Eigen::Vector3d(100, 50, 20)))
                .norm(),
            1e-3);
  // Degrees, feet, unknown, no CRS, the other side of the earth, with a vertical system.
  for (const char* crs :
       {"EPSG:4326", "EPSG:2263", "EPSG:1", "chart datum", "EPSG:32755", "EPSG:25832+5783"}) {
    try {
      MapProjection(kDatum, Eigen::Vector2d::Zero(), crs, 0);
      ADD_FAILURE() << crs;
    } catch (const std::runtime_error& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr(crs));
    }
  }
}

// Elevations are positive up: a system of depths would turn them over.
TEST(MapProjection, TakesNoCodeThatIsNoSystemOfHeights) {
  for (const int heights : {5829, 5714, 5703}) EXPECT_TRUE(IsHeightSystem(heights)) << heights;
  for (const int code : {5831, 5861, 4326, 32'632, 99'999, -1}) {
    EXPECT_FALSE(IsHeightSystem(code)) << code;
    EXPECT_THROW(MapProjection(kDatum, Eigen::Vector2d::Zero(), "", code), std::runtime_error);
  }
}

// Its text has plus signs of its own.
TEST(MapProjection, OfAProjStringMakesEveryFile) {
  const MapProjection projection(
      kDatum, Eigen::Vector2d::Zero(), "+proj=utm +zone=32 +datum=WGS84 +units=m", 5829);
  EXPECT_LT((projection.NorthEast(Eigen::Vector3d(100, 50, 20)) -
             Utm().NorthEast(Eigen::Vector3d(100, 50, 20)))
                .norm(),
            1e-6);
  const GridGeometry g = SmallGrid();
  const Raster raster = Ramp(g);
  EXPECT_FALSE(GeoTiff(g, raster, projection).empty());
  EXPECT_FALSE(Bag(g, {raster, raster, "a", FromUtime(1)}, projection).empty());
  EXPECT_FALSE(GeoPackage({}, projection).empty());
}

// A zone that crosses the antimeridian, and neighbours.
TEST(GeographicConverter, KnowsForWhichPlacesItIsMade) {
  EXPECT_TRUE(GeographicConverter("EPSG:32632").IsMadeFor({57.0, 9.0}));
  EXPECT_TRUE(GeographicConverter("EPSG:32632").IsMadeFor({57.0, 13.0}));
  EXPECT_FALSE(GeographicConverter("EPSG:32632").IsMadeFor({57.0, -70.0}));
  EXPECT_FALSE(GeographicConverter("EPSG:32632").IsMadeFor({-20.0, 9.0}));
  EXPECT_TRUE(GeographicConverter("EPSG:2193").IsMadeFor({-44.0, -177.0}));  // New Zealand
  EXPECT_TRUE(GeographicConverter("EPSG:2193").IsMadeFor({-44.0, 170.0}));
  EXPECT_FALSE(GeographicConverter("EPSG:2193").IsMadeFor({-44.0, 0.0}));
  EXPECT_TRUE(GeographicConverter("+proj=utm +zone=32 +datum=WGS84").IsMadeFor({10.0, 100.0}));
}

TEST(GeoTiff, PutsAKnownLatitudeAndLongitudeIntoTheRightCell) {
  const TemporaryDir folder;
  const MapProjection projection = Utm();
  const Eigen::Vector2d middle = projection.NorthEast(Eigen::Vector3d::Zero());
  const GridGeometry g =
      GridGeometry::Covering(middle - Eigen::Vector2d(25, 40), middle + Eigen::Vector2d(25, 40), 2);
  WriteAtomically(folder / "a.tif", GeoTiff(g, Ramp(g), projection));
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
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(-11, 7, 0), Eigen::Vector3d(17, -31, 0)}) {
    double x = 0, y = 0, height = 0;
    local.Reverse(p.y(), p.x(), -p.z(), y, x, height);
    ASSERT_TRUE(transform->Transform(1, &x, &y));
    const Eigen::Vector2d at = projection.NorthEast(p);
    EXPECT_NEAR(x, at.y(), 1e-4);
    EXPECT_NEAR(y, at.x(), 1e-4);
    EXPECT_EQ(Pixel(tif->GetRasterBand(1),
                    static_cast<int>(to_pixel[0] + to_pixel[1] * x),
                    static_cast<int>(to_pixel[3] + to_pixel[5] * y)),
              static_cast<float>(100 * g.Row(at.x()) + g.Col(at.y())));
  }
}

TEST(GeoTiff, IsCloudOptimisedWithStatisticsAndNoData) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  WriteAtomically(folder / "a.tif", GeoTiff(g, Ramp(g), Utm()));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  ASSERT_EQ(tif->GetRasterCount(), 1);
  GDALRasterBand* band = tif->GetRasterBand(1);
  EXPECT_EQ(band->GetRasterDataType(), GDT_Float32);
  EXPECT_STREQ(band->GetDescription(), "elevation");
  EXPECT_STREQ(band->GetUnitType(), "m");
  EXPECT_EQ(band->GetNoDataValue(), static_cast<double>(kNoData));
  EXPECT_EQ(Pixel(band, 4, g.rows - 1 - 3), kNoData);
  EXPECT_STREQ(tif->GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE"), "DEFLATE");
  EXPECT_STREQ(tif->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  EXPECT_EQ(tif->GetMetadataItem("TIFFTAG_DATETIME"), nullptr);
  ASSERT_NE(band->GetMetadataItem("STATISTICS_MAXIMUM"), nullptr);
  EXPECT_EQ(std::stod(band->GetMetadataItem("STATISTICS_MAXIMUM")),
            100.0 * (g.rows - 1) + (g.cols - 1));
  EXPECT_EQ(band->GetOverviewCount(), 0);
}

TEST(GeoTiff, OfALargeMapHasOverviewsAndCountsAreIntegers) {
  const TemporaryDir folder;
  const GridGeometry g = GridGeometry::Covering({0, 0}, {1500, 2000}, 1.0);
  Raster counts;
  counts.type = RasterType::kCount;
  counts.values.assign(g.size(), 70'000.0f);
  counts.values[0] = kNoData;  // the south-west corner
  WriteAtomically(folder / "a.tif", GeoTiff(g, counts, Utm()));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  GDALRasterBand* band = tif->GetRasterBand(1);
  EXPECT_EQ(band->GetRasterDataType(), GDT_UInt32);
  EXPECT_EQ(band->GetNoDataValue(), 0.0);
  EXPECT_EQ(Pixel(band, 0, g.rows - 1), 0.0f);
  EXPECT_EQ(Pixel(band, 7, 7), 70'000.0f);
  ASSERT_GE(band->GetOverviewCount(), 2);
  EXPECT_EQ(band->GetOverview(0)->GetXSize(), g.cols / 2);
  EXPECT_EQ(Pixel(band->GetOverview(1), 9, 9), 70'000.0f);
}

TEST(GeoTiff, StatesTheVerticalSystemOfElevationsAlone) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  Raster spread = Ramp(g);
  spread.is_vertical = false;
  WriteAtomically(folder / "a.tif", GeoTiff(g, Ramp(g), Utm(5829)));
  WriteAtomically(folder / "b.tif", GeoTiff(g, spread, Utm(5829)));
  const Dataset elevation = Open(folder / "a.tif", GDAL_OF_RASTER);
  const Dataset other = Open(folder / "b.tif", GDAL_OF_RASTER);
  ASSERT_TRUE(elevation != nullptr && other != nullptr);
  EXPECT_TRUE(elevation->GetSpatialRef()->IsCompound());
  EXPECT_STREQ(elevation->GetSpatialRef()->GetAuthorityCode("PROJCS"), "32632");
  EXPECT_STREQ(elevation->GetSpatialRef()->GetAuthorityCode("VERT_CS"), "5829");
  EXPECT_FALSE(other->GetSpatialRef()->IsCompound());
}

TEST(GeoTiff, HasLocalMetresButNoProjectionWithoutADatum) {
  const TemporaryDir folder;
  const GridGeometry g = SmallGrid();
  WriteAtomically(folder / "a.tif", GeoTiff(g, Ramp(g), MapProjection()));
  const Dataset tif = Open(folder / "a.tif", GDAL_OF_RASTER);
  ASSERT_NE(tif, nullptr);
  EXPECT_EQ(tif->GetSpatialRef(), nullptr);
  double to_map[6];
  ASSERT_EQ(tif->GetGeoTransform(to_map), CE_None);
  EXPECT_EQ(to_map[0], 100.0);
  EXPECT_EQ(to_map[3], 32.0);  // upper edge of the highest row
  EXPECT_EQ(to_map[5], -2.0);
}

TEST(GeoTiff, IsTheSameBytesEveryTime) {
  const GridGeometry g = SmallGrid();
  EXPECT_EQ(GeoTiff(g, Ramp(g), Utm()), GeoTiff(g, Ramp(g), Utm()));
}

// HDF5 notes when each object was made, to the second.
TEST(Bag, IsReadBackByGdalAndHoldsNoTimeOfItsMaking) {
  const GridGeometry g = SmallGrid();
  Raster sigma = Ramp(g);
  for (float& value : sigma.values)
    if (value != kNoData) value = 0.25f;
  const Raster elevation = Ramp(g);
  const Time start = FromUtime(1'700'000'000'000'000);
  const BagContent content{elevation, sigma, "Bay & <wreck>", start + FromSeconds(600.0)};
  const std::string bytes = Bag(g, content, Utm(5829));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  EXPECT_EQ(bytes, Bag(g, content, Utm(5829)));
  const TemporaryDir folder;
  WriteAtomically(folder / "a.bag", bytes);
  const Dataset bag = Open(folder / "a.bag", GDAL_OF_RASTER);
  ASSERT_NE(bag, nullptr);
  ASSERT_EQ(bag->GetRasterCount(), 2);
  EXPECT_EQ(Pixel(bag->GetRasterBand(1), 6, g.rows - 1 - 5), 506.0f);
  EXPECT_EQ(Pixel(bag->GetRasterBand(2), 6, g.rows - 1 - 5), 0.25f);
  EXPECT_EQ(Pixel(bag->GetRasterBand(1), 4, g.rows - 1 - 3), 1e6f);
  EXPECT_EQ(bag->GetRasterBand(1)->GetNoDataValue(), 1e6);
  EXPECT_STREQ(bag->GetSpatialRef()->GetAuthorityCode("PROJCS"), "32632");
  EXPECT_STREQ(bag->GetSpatialRef()->GetAttrValue("VERT_CS"), "Instantaneous Water Level height");
  double to_map[6];
  ASSERT_EQ(bag->GetGeoTransform(to_map), CE_None);
  EXPECT_EQ(to_map[0], 100.0);
  EXPECT_EQ(to_map[3], 32.0);
  EXPECT_STREQ(bag->GetMetadataItem("BAG_DATETIME"), "2023-11-14T22:23:20");
  char** xml = bag->GetMetadata("xml:BAG");
  ASSERT_NE(xml, nullptr);
  for (const char* part :
       {"productUncert", "<gco:Date>2023-11-14</gco:Date>", "Bay &amp; &lt;wreck&gt;"})
    EXPECT_THAT(xml[0], ::testing::HasSubstr(part));
  EXPECT_THAT(xml[0], ::testing::Not(::testing::HasSubstr("&amp;amp;")));
}

TEST(GeoPackage, HoldsEveryLayerAndFieldAndTheSameBytesEveryTime) {
  const TemporaryDir folder;
  VectorLayer areas{"footprints", VectorShape::kPolygons, {}};
  areas.features.push_back({{{0, 0}, {0, 4}, {3, 4}, {3, 0}},
                            {{"submap", std::int64_t{7}},
                             {"closed_by", std::string("turn")},
                             {"start", FromUtime(1'700'000'000'250'000)},
                             {"end", Time{}}}});
  VectorLayer lines{"edges", VectorShape::kLines, {}};
  lines.features.push_back({{{0, 0}, {10, 20}}, {{"weight", std::nan("")}}});
  VectorLayer points{"fixes", VectorShape::kPoints, {}};
  points.features.push_back({{{5, 6}}, {{"sigma_m", 0.5}}});
  const std::string bytes = GeoPackage({areas, lines, points}, Utm(5829));
  EXPECT_EQ(bytes, GeoPackage({areas, lines, points}, Utm(5829)));
  WriteAtomically(folder / "a.gpkg", bytes);
  const Dataset gpkg = Open(folder / "a.gpkg", GDAL_OF_VECTOR);
  ASSERT_NE(gpkg, nullptr);
  ASSERT_EQ(gpkg->GetLayerCount(), 3);
  OGRLayer* footprints = gpkg->GetLayerByName("footprints");
  ASSERT_NE(footprints, nullptr);
  EXPECT_STREQ(footprints->GetSpatialRef()->GetAuthorityCode(nullptr), "32632");
  const OGRFeatureDefn* fields = footprints->GetLayerDefn();
  EXPECT_EQ(fields->GetFieldDefn(0)->GetType(), OFTInteger64);
  EXPECT_EQ(fields->GetFieldDefn(2)->GetType(), OFTDateTime);
  const std::unique_ptr<OGRFeature> area(footprints->GetNextFeature());
  EXPECT_EQ(area->GetFieldAsInteger64("submap"), 7);
  EXPECT_STREQ(area->GetFieldAsString("closed_by"), "turn");
  EXPECT_STREQ(area->GetFieldAsString("start"), "2023/11/14 22:13:20.250+00");
  EXPECT_FALSE(area->IsFieldSetAndNotNull(3));
  EXPECT_EQ(area->GetGeometryRef()->toPolygon()->get_Area(), 12.0);
  const std::unique_ptr<OGRFeature> line(gpkg->GetLayerByName("edges")->GetNextFeature());
  EXPECT_FALSE(line->IsFieldSetAndNotNull(0));
  EXPECT_EQ(line->GetGeometryRef()->toLineString()->getX(1), 20.0);  // east
  EXPECT_EQ(line->GetGeometryRef()->toLineString()->getY(1), 10.0);  // north
  const std::unique_ptr<OGRFeature> point(gpkg->GetLayerByName("fixes")->GetNextFeature());
  EXPECT_EQ(point->GetGeometryRef()->toPoint()->getX(), 6.0);
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
      grid.Project(&p);
      EXPECT_NEAR(p[0].x(), y, 1e-4);
      EXPECT_NEAR(p[0].y(), x, 1e-4);
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
  EXPECT_NEAR(GeographicConverter(Utm().Wkt()).z_unit_m(), 1.0, 1e-12);
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
