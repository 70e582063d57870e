#include "products/geo/geographic_converter.hpp"

#include <ogr_spatialref.h>

#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "products/geo/gdal_use.hpp"

namespace seastitch {
namespace {

struct Destroy {
  void operator()(OGRCoordinateTransformation* t) const {
    OGRCoordinateTransformation::DestroyCT(t);
  }
};
using OwnedTransformation = std::unique_ptr<OGRCoordinateTransformation, Destroy>;

OwnedTransformation Between(const OGRSpatialReference& from, const OGRSpatialReference& to) {
  OwnedTransformation made(OGRCreateCoordinateTransformation(&from, &to));
  Require(made != nullptr, "coordinate reference system");
  return made;
}

// Points as (x, y) of GDAL.
void Transform(OGRCoordinateTransformation* by, std::vector<Eigen::Vector2d>* points) {
  const QuietGdal quiet;
  std::vector<double> x, y;
  for (const Eigen::Vector2d& p : *points) {
    x.push_back(p.x());
    y.push_back(p.y());
  }
  std::vector<int> good(points->size(), FALSE);
  by->Transform(static_cast<int>(points->size()), x.data(), y.data(), nullptr, good.data());
  for (std::size_t i = 0; i < points->size(); ++i)
    (*points)[i] =
        good[i] != FALSE ? Eigen::Vector2d(x[i], y[i]) : Eigen::Vector2d::Constant(std::nan(""));
}

}  // namespace

struct GeographicConverter::Transformation {
  OwnedTransformation to_wgs84, from_wgs84;
};

GeographicConverter::GeographicConverter(const std::string& crs)
    : transformation_(std::make_unique<Transformation>()) {
  const QuietGdal quiet;
  OGRSpatialReference from = ReferenceSystem(crs);
  name_ = from.GetName() != nullptr ? from.GetName() : "without a name";
  OGRAxisOrientation axis = OAO_Other;
  if (from.GetAxis("VERT_CS", 0, &axis) != nullptr) z_is_down_ = axis == OAO_Down;
  if (from.GetAttrNode("VERT_CS") != nullptr)
    z_unit_m_ = from.GetTargetLinearUnits("VERT_CS");
  else if (from.IsProjected() != 0)
    z_unit_m_ = from.GetLinearUnits();
  is_metric_ = from.IsProjected() != 0 && from.GetLinearUnits() == 1.0;
  std::array<double, 4> area{};
  if (from.GetAreaOfUse(&area[0], &area[1], &area[2], &area[3], nullptr)) area_deg_ = area;
  if (from.IsCompound() != 0) from.StripVertical();
  const OGRSpatialReference to = ReferenceSystem("+proj=longlat +datum=WGS84 +no_defs");
  transformation_->to_wgs84 = Between(from, to);
  transformation_->from_wgs84 = Between(to, from);
}

std::string WktOf(const std::string& crs) {
  const QuietGdal quiet;
  const OGRSpatialReference srs = ReferenceSystem(crs);
  char* text = nullptr;
  const char* const options[] = {"FORMAT=WKT1_GDAL", nullptr};
  Require(srs.exportToWkt(&text, options) == OGRERR_NONE, crs);
  const std::string wkt(text);
  CPLFree(text);
  return wkt;
}

GeographicConverter::~GeographicConverter() = default;
GeographicConverter::GeographicConverter(GeographicConverter&&) noexcept = default;

bool GeographicConverter::IsMadeFor(const Datum& point) const {
  constexpr double kSlackDeg = 6.0;  // a neighbouring zone
  if (!area_deg_) return true;
  const auto [west, south, east, north] = *area_deg_;
  if (point.latitude_deg < south - kSlackDeg || point.latitude_deg > north + kSlackDeg)
    return false;
  // East of west, once around the earth; the area may cross the antimeridian.
  const double width = std::fmod(east - west + 720.0, 360.0);
  const double at = std::fmod(point.longitude_deg - west + kSlackDeg + 720.0, 360.0);
  return width == 0.0 || at <= width + 2.0 * kSlackDeg;
}

void GeographicConverter::Convert(std::vector<Eigen::Vector2d>* points) const {
  Transform(transformation_->to_wgs84.get(), points);
  for (Eigen::Vector2d& p : *points) p = {Deg2Rad(p.y()), Deg2Rad(p.x())};
}

void GeographicConverter::Project(std::vector<Eigen::Vector2d>* points) const {
  for (Eigen::Vector2d& p : *points) p = {Rad2Deg(p.y()), Rad2Deg(p.x())};
  Transform(transformation_->from_wgs84.get(), points);
  for (Eigen::Vector2d& p : *points) p = {p.y(), p.x()};
}

}  // namespace seastitch
