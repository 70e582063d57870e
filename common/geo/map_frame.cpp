#include "common/geo/map_frame.hpp"

#include <GeographicLib/LocalCartesian.hpp>

#include "common/core/pose.hpp"

namespace seastitch {

std::string LargestMapText() {
  return std::to_string(static_cast<int>(kLargestMapM / 1000.0)) + " km";
}

Datum DatumOf(const VehicleGeometry& vehicle) {
  return {Rad2Deg(vehicle.datum.latitude_rad), Rad2Deg(vehicle.datum.longitude_rad)};
}

MapFrame::MapFrame(const Datum& origin)
    : plane_(std::make_shared<GeographicLib::LocalCartesian>(
          origin.latitude_deg, origin.longitude_deg, 0.0)) {}

Eigen::Vector2d MapFrame::NorthEastOf(const GeoPoint& point) const {
  return NorthEastOf(Datum{Rad2Deg(point.latitude_rad), Rad2Deg(point.longitude_rad)});
}

Eigen::Vector2d MapFrame::NorthEastOf(const Datum& point) const {
  double east_m = 0.0, north_m = 0.0, up_m = 0.0;
  plane_->Forward(point.latitude_deg, point.longitude_deg, 0.0, east_m, north_m, up_m);
  return {north_m, east_m};
}

Datum MapFrame::PointAt(const Eigen::Vector2d& north_east_m, double down_m) const {
  Datum point;
  double height_m = 0.0;
  plane_->Reverse(north_east_m.y(),
                  north_east_m.x(),
                  -down_m,
                  point.latitude_deg,
                  point.longitude_deg,
                  height_m);
  return point;
}

}  // namespace seastitch
