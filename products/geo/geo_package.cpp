#include "products/geo/geo_package.hpp"

#include <cpl_conv.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "products/geo/gdal_use.hpp"

namespace seastitch {
namespace {

std::unique_ptr<OGRGeometry> GeometryOf(const VectorFeature& feature, VectorShape shape) {
  if (shape == VectorShape::kPoints)
    return std::make_unique<OGRPoint>(feature.north_east.at(0).y(), feature.north_east.at(0).x());
  const bool polygon = shape == VectorShape::kPolygons;
  auto line = polygon ? std::make_unique<OGRLinearRing>() : std::make_unique<OGRLineString>();
  for (const Eigen::Vector2d& p : feature.north_east) line->addPoint(p.y(), p.x());
  if (!polygon) return line;
  line->closeRings();
  auto area = std::make_unique<OGRPolygon>();
  area->addRing(static_cast<OGRLinearRing*>(line.get()));
  return area;
}

OGRwkbGeometryType TypeOf(VectorShape shape) {
  switch (shape) {
    case VectorShape::kPoints: return wkbPoint;
    case VectorShape::kLines: return wkbLineString;
    case VectorShape::kPolygons: return wkbPolygon;
  }
  return wkbUnknown;
}

// Of the variant, by its index.
OGRFieldType TypeOf(const VectorField& field) {
  constexpr OGRFieldType kTypes[] = {OFTInteger64, OFTReal, OFTString, OFTDateTime};
  return kTypes[field.value.index()];
}

void SetTime(OGRFeature* row, int field, Time time) {
  const std::chrono::sys_time<Duration> utc(time.time_since_epoch());
  const auto day = std::chrono::floor<std::chrono::days>(utc);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(utc - day);
  constexpr int kUtc = 100;
  row->SetField(field,
                static_cast<int>(date.year()),
                static_cast<int>(static_cast<unsigned>(date.month())),
                static_cast<int>(static_cast<unsigned>(date.day())),
                static_cast<int>(clock.hours().count()),
                static_cast<int>(clock.minutes().count()),
                static_cast<float>(static_cast<double>(clock.seconds().count()) +
                                   1e-6 * static_cast<double>(clock.subseconds().count())),
                kUtc);
}

void SetValue(OGRFeature* row, int at, const VectorField& field) {
  if (const auto* text = std::get_if<std::string>(&field.value))
    row->SetField(at, text->c_str());
  else if (const auto* number = std::get_if<double>(&field.value); number && std::isfinite(*number))
    row->SetField(at, *number);
  else if (const auto* count = std::get_if<std::int64_t>(&field.value))
    row->SetField(at, static_cast<GIntBig>(*count));
  else if (const auto* time = std::get_if<Time>(&field.value); time && *time != Time{})
    SetTime(row, at, *time);
}

void WriteFeature(OGRLayer* out, const VectorFeature& feature, VectorShape shape) {
  struct Destroy {
    void operator()(OGRFeature* f) const { OGRFeature::DestroyFeature(f); }
  };
  const std::unique_ptr<OGRFeature, Destroy> row(OGRFeature::CreateFeature(out->GetLayerDefn()));
  for (const VectorField& field : feature.fields)
    SetValue(row.get(), row->GetFieldIndex(field.name.c_str()), field);
  row->SetGeometry(GeometryOf(feature, shape).get());
  Require(out->CreateFeature(row.get()) == OGRERR_NONE, "GeoPackage");
}

void WriteLayer(GDALDataset* dataset, const VectorLayer& layer, OGRSpatialReference* srs) {
  OGRLayer* out = dataset->CreateLayer(layer.name.c_str(), srs, TypeOf(layer.shape));
  Require(out != nullptr, "GeoPackage");
  if (layer.features.empty()) return;
  for (const VectorField& field : layer.features.front().fields) {
    OGRFieldDefn definition(field.name.c_str(), TypeOf(field));
    Require(out->CreateField(&definition) == OGRERR_NONE, "GeoPackage");
  }
  for (const VectorFeature& feature : layer.features) WriteFeature(out, feature, layer.shape);
}

}  // namespace

std::string GeoPackage(const std::vector<VectorLayer>& layers, const MapProjection& projection) {
  const QuietGdal quiet;
  // GeoPackage tables hold the date of their last change: pinned, so that the bytes repeat.
  const CPLConfigOptionSetter date("OGR_CURRENT_DATE", "1970-01-01T00:00:00.000Z", false);
  const MemoryFile file("/vsimem/seastitch_survey.gpkg");
  Dataset dataset(GdalDriver("GPKG")->Create(file.path(), 0, 0, 0, GDT_Unknown, nullptr));
  Require(dataset != nullptr, "GeoPackage");
  std::optional<OGRSpatialReference> srs;
  if (projection.has_crs()) srs = ReferenceSystem(projection.horizontal());
  for (const VectorLayer& layer : layers) WriteLayer(dataset.get(), layer, srs ? &*srs : nullptr);
  dataset.reset();
  return file.Bytes();
}

}  // namespace seastitch
