#pragma once

#include <cstdint>
#include <vector>

#include "common/core/grid.hpp"
#include "products/map/map_points.hpp"

namespace seastitch {

// Weighted running mean and squared deviation of the depths in a cell (D. H. D. West, "Updating
// mean and variance estimates", CACM 1979): keeps millimetres at 6000 m.
struct DepthCell {
  double mean_m = 0.0;
  double squares_m2 = 0.0;  // sum of weight * (depth - mean)^2
  double soundings = 0.0;

  void Add(double depth_m, double weight);
  // Standard deviation of the points about their mean. A point may itself be the mean of several
  // soundings, so this is the spread of the map's points, a little below that of the soundings.
  double Spread() const;
};

// Depth map of a survey, positive down. Each point has the number of its soundings as weight.
class DepthMap {
 public:
  explicit DepthMap(const GridGeometry& geometry) : cells_(geometry) {}
  void Add(const std::vector<MapPoint>& points);
  const Grid<DepthCell>& cells() const { return cells_; }

 private:
  Grid<DepthCell> cells_;
};

}  // namespace seastitch
