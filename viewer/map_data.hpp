#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/grid.hpp"

namespace seastitch {

// What the viewer draws over a map: north and east [m].
struct MapLines {
  using Line = std::vector<Eigen::Vector2d>;
  struct Closure {
    Line line;
    bool used = false;  // by the graph
  };
  struct Submap {
    std::int64_t id = 0;
    Line outline;  // corners; the first is not repeated
  };

  std::vector<Line> track;
  std::vector<Line> track_as_navigated;
  std::vector<Closure> closures;
  std::vector<Submap> submaps;
};

// Map of the viewer (viewer.js) as JSON: rasters, coarsened so that a page stays a few megabytes,
// and lines.
class MapData {
 public:
  explicit MapData(const GridGeometry& geometry);

  // Adds a raster of the geometry, in metres. name: as viewer.js knows it. none: marks cells
  // without a value.
  void Add(const std::string& name, const std::vector<float>& values, float none);
  // Side of a cell of the page [m].
  double cell_m() const { return coarse_.cell_m; }
  // JSON to stand in an element of an HTML page: without the character <.
  std::string Json(const MapLines& lines) const;

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
