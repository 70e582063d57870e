#pragma once

namespace seastitch {

// Largest distance of a map's points from its origin [m]: beyond it the tangent plane leaves the
// ellipsoid by kilometres.
inline constexpr double kLargestMapM = 200'000.0;

// A point on the WGS 84 ellipsoid, in degrees, such as the map origin.
struct Datum {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

}  // namespace seastitch
