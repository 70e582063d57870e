#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "common/core/vehicle.hpp"
#include "common/geo/datum.hpp"

namespace GeographicLib {
class LocalCartesian;
}

namespace seastitch {

// kLargestMapM for people: "200 km".
std::string LargestMapText();

// Datum of a vehicle.yaml.
Datum DatumOf(const VehicleGeometry& vehicle);

// The map frame: north, east, down [m] in the tangent plane at the map origin, on the WGS 84
// ellipsoid (docs/frames.md).
class MapFrame {
 public:
  explicit MapFrame(const Datum& origin);

  // North and east of a point on the ellipsoid [m].
  Eigen::Vector2d NorthEastOf(const GeoPoint& point) const;
  Eigen::Vector2d NorthEastOf(const Datum& point) const;
  // Latitude and longitude of a point of the map.
  Datum PointAt(const Eigen::Vector2d& north_east_m, double down_m = 0.0) const;

 private:
  std::shared_ptr<const GeographicLib::LocalCartesian> plane_;
};

}  // namespace seastitch
