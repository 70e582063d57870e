#pragma once

namespace seastitch {

// A point on the WGS 84 ellipsoid, in degrees, such as the map origin.
struct Datum {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

}  // namespace seastitch
