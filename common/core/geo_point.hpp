#pragma once

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

// A point on the WGS 84 ellipsoid.
struct GeoPoint {
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;
};

inline constexpr double kMeanEarthRadiusM = 6'371'000.0;

// North and east [m] from one point to another near it, on a sphere.
inline Eigen::Vector2d NorthEastBetween(const GeoPoint& from, const GeoPoint& to) {
  return kMeanEarthRadiusM * Eigen::Vector2d(to.latitude_rad - from.latitude_rad,
                                             std::cos(from.latitude_rad) *
                                                 WrapAngle(to.longitude_rad - from.longitude_rad));
}
inline double DistanceM(const GeoPoint& a, const GeoPoint& b) {
  const Eigen::Vector2d between_m = NorthEastBetween(a, b);
  return Hypotenuse(between_m.x(), between_m.y());
}

}  // namespace seastitch
