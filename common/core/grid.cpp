#include "common/core/grid.hpp"

#include <limits>

namespace seastitch {

GridGeometry GridGeometry::Covering(const Eigen::Vector2d& min,
                                    const Eigen::Vector2d& max,
                                    double cell_m,
                                    std::size_t max_cells) {
  const Eigen::Vector2d low = (min / cell_m).array().floor();
  const Eigen::Vector2d count = (max / cell_m).array().floor() - low.array() + 1.0;
  const bool sane = cell_m > 0.0 && low.allFinite() && count.allFinite() &&
                    (count.array() >= 1.0).all() &&
                    (count.array() <= std::numeric_limits<int>::max()).all() &&
                    count.x() * count.y() <= static_cast<double>(max_cells);
  if (!sane) throw std::length_error("grid extent is not finite, empty or above the cell limit");
  GridGeometry g;
  g.origin = low * cell_m;
  g.cell_m = cell_m;
  g.rows = static_cast<int>(count.x());
  g.cols = static_cast<int>(count.y());
  return g;
}

}  // namespace seastitch
