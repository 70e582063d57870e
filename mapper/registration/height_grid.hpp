#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "mapper/registration/registration.hpp"

namespace seastitch {

// The smoothed seabed anywhere between the cells of a level.
struct HeightSample {
  double height_m = 0.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double variance = 0.0;  // of the height, from soundings of unit variance
  Eigen::Vector2d covariance = Eigen::Vector2d::Zero();  // of height and slope, from the same
};

// The four cells around a place, and how near each is (sum 1).
struct CellsAround {
  int row;
  int col;
  double row_part;  // 0: on `row`, 1: on `row` + 1
  double col_part;
  double Part(int i, int j) const {
    return (i ? row_part : 1.0 - row_part) * (j ? col_part : 1.0 - col_part);
  }
};

inline std::optional<CellsAround> FindCells(const GridGeometry& g, const Eigen::Vector2d& p) {
  const Eigen::Vector2d at = (p - g.origin) / g.cell_m - Eigen::Vector2d(0.5, 0.5);
  if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() < g.rows - 1 && at.y() < g.cols - 1))
    return std::nullopt;
  const int row = static_cast<int>(at.x());
  const int col = static_cast<int>(at.y());
  return CellsAround{row, col, at.x() - row, at.y() - col};
}

// Heights between cells go by half of each cell's slope: exact for every quadratic surface.
inline bool Interpolate(const Grid<RegistrationSubmap::Cell>& grid,
                        const Eigen::Vector2d& p,
                        CellsAround* around,
                        HeightSample* out) {
  const auto found = FindCells(grid.geometry(), p);
  if (!found) return false;
  *around = *found;
  const double half_cell = 0.5 * grid.geometry().cell_m;
  *out = HeightSample{};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const RegistrationSubmap::Cell& cell = grid(around->row + i, around->col + j);
      if (!(cell.variance > 0.0f)) return false;
      const double part = around->Part(i, j);
      out->height_m += part * (cell.height_m + half_cell * (cell.slope_x * (around->row_part - i) +
                                                            cell.slope_y * (around->col_part - j)));
      out->slope.x() += part * cell.slope_x;
      out->slope.y() += part * cell.slope_y;
      out->variance += part * cell.variance;
      out->covariance.x() += part * cell.covariance_x;
      out->covariance.y() += part * cell.covariance_y;
    }
  }
  return true;
}

}  // namespace seastitch
