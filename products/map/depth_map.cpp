#include "products/map/depth_map.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {

void DepthCell::Add(double depth_m, double weight) {
  soundings += weight;
  const double delta = depth_m - mean_m;
  mean_m += delta * weight / soundings;
  squares_m2 += weight * delta * (depth_m - mean_m);
}

double DepthCell::Spread() const {
  return soundings > 0.0 ? std::sqrt(std::max(0.0, squares_m2 / soundings)) : 0.0;
}

void DepthMap::Add(const std::vector<MapPoint>& points) {
  const GridGeometry& g = cells_.geometry();
  for (const MapPoint& point : points) {
    const int row = std::clamp(g.Row(point.p_ned.x()), 0, g.rows - 1);
    const int col = std::clamp(g.Col(point.p_ned.y()), 0, g.cols - 1);
    cells_(row, col).Add(point.p_ned.z(), point.soundings);
  }
}

}  // namespace seastitch
