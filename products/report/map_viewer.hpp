#pragma once

#include <string>
#include <vector>

#include "common/core/grid.hpp"
#include "products/geo/geo_package.hpp"
#include "products/geo/raster.hpp"

namespace seastitch {

// Data of the map in report.html (viewer.js): rasters, coarsened so that the page stays a few
// megabytes, and the lines of the survey.
class MapViewer {
 public:
  explicit MapViewer(const GridGeometry& geometry);

  // Adds a raster of the geometry, in metres. name: as viewer.js knows it.
  void Add(const std::string& name, const Raster& raster);
  // Side of a cell of the page [m].
  double cell_m() const { return coarse_.cell_m; }
  // JSON to stand in an element of an HTML page: without the character <.
  std::string Data(const std::vector<VectorLayer>& layers) const;

 private:
  struct Packed {
    std::string name;
    double lowest_m = 0.0;
    double step_m = 0.0;
    std::string base64;
  };
  GridGeometry fine_;
  GridGeometry coarse_;
  int cells_a_side_;  // of fine_ in a cell of coarse_
  std::vector<Packed> rasters_;
};

}  // namespace seastitch
