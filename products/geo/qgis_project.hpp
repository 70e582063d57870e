#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "products/geo/map_projection.hpp"

namespace seastitch {

// One layer of a QGIS project, whose file lies beside it.
struct QgisLayer {
  enum class Kind { kHillshade, kElevation, kPoints, kLines, kPolygons };
  Kind kind = Kind::kLines;
  std::string file;
  std::string table;  // of a GeoPackage; empty: the file itself
  std::string title;
  bool visible = true;
  // Elevations: ends of the colour ramp [m]. Others: colour as "red,green,blue,alpha".
  std::pair<double, double> range_m{0.0, 1.0};
  std::string colour;
};

// The text of a QGIS project (3.22 and later) with relative paths; the first layer is on top. The
// projection has a CRS. north_east: what the window shows at first. The same content gives the same
// bytes.
std::string QgisProject(const std::string& title,
                        const MapProjection& projection,
                        const Eigen::AlignedBox2d& north_east,
                        const std::vector<QgisLayer>& layers);

}  // namespace seastitch
