#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace seastitch {

// Geometry of a regular horizontal grid, in the map or in a level frame. Cell (row, col) covers
// x in origin.x + [row, row + 1) * cell, y in origin.y + [col, col + 1) * cell.
struct GridGeometry {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // corner with the lowest x and y [m]
  double cell_m = 1.0;
  int rows = 0;  // along x (north in the map frame)
  int cols = 0;  // along y (east in the map frame)

  // The smallest grid that covers all points from min to max, both included. Its origin is at a
  // multiple of cell_m. Throws std::length_error where it would have more than max_cells cells, so
  // that an outlier does not cause a huge allocation.
  static GridGeometry Covering(const Eigen::Vector2d& min,
                               const Eigen::Vector2d& max,
                               double cell_m,
                               std::size_t max_cells = 200'000'000);

  std::size_t size() const {
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
  }
  bool Contains(int row, int col) const { return row >= 0 && row < rows && col >= 0 && col < cols; }
  // Index of a cell in row-major order. The grid must contain it.
  std::size_t Index(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) +
           static_cast<std::size_t>(col);
  }
  // Row or column of a coordinate. Outside of the grid, and for NaN, Contains() is false for the
  // result, which may be negative.
  int Row(double x) const { return ToCell((x - origin.x()) / cell_m); }
  int Col(double y) const { return ToCell((y - origin.y()) / cell_m); }
  Eigen::Vector2d Center(int row, int col) const {
    return origin + cell_m * Eigen::Vector2d(row + 0.5, col + 0.5);
  }

 private:
  static int ToCell(double cells) {
    constexpr double kFar = 2e9;  // beyond any grid, and small enough that result + 1 is an int
    // std::min in this order makes +kFar of a NaN.
    return static_cast<int>(std::max(-kFar, std::min(kFar, std::floor(cells))));
  }
};

// A value for each cell of a grid. Access is not checked: the geometry must contain the cell.
template <class Cell>
class Grid {
 public:
  Grid() = default;
  explicit Grid(const GridGeometry& geometry, const Cell& fill = Cell{})
      : geometry_(geometry), cells_(geometry.size(), fill) {}

  const GridGeometry& geometry() const { return geometry_; }
  Cell& operator()(int row, int col) { return cells_[geometry_.Index(row, col)]; }
  const Cell& operator()(int row, int col) const { return cells_[geometry_.Index(row, col)]; }
  std::vector<Cell>& cells() { return cells_; }
  const std::vector<Cell>& cells() const { return cells_; }

 private:
  GridGeometry geometry_;
  std::vector<Cell> cells_;
};

}  // namespace seastitch
