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
  double variance = 0.0;                                 // of the height, as Cell::variance
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
  using Cell = RegistrationSubmap::Cell;
  const auto found = FindCells(grid.geometry(), p);
  if (!found) return false;
  *around = *found;
  const Cell* first = &grid(around->row, around->col);
  const Cell* second = first + grid.geometry().cols;
  const Cell &c00 = first[0], &c01 = first[1], &c10 = second[0], &c11 = second[1];
  if (!(c00.variance > 0.0f && c01.variance > 0.0f && c10.variance > 0.0f && c11.variance > 0.0f))
    return false;
  const double w00 = around->Part(0, 0);
  const double w01 = around->Part(0, 1);
  const double w10 = around->Part(1, 0);
  const double w11 = around->Part(1, 1);
  const auto mean = [&](float Cell::*value) {
    return (w00 * c00.*value + w01 * c01.*value) + (w10 * c10.*value + w11 * c11.*value);
  };
  out->slope = {mean(&Cell::slope_x), mean(&Cell::slope_y)};
  const double rise_x = around->row_part * out->slope.x() - (w10 * c10.slope_x + w11 * c11.slope_x);
  const double rise_y = around->col_part * out->slope.y() - (w01 * c01.slope_y + w11 * c11.slope_y);
  out->height_m = mean(&Cell::height_m) + 0.5 * grid.geometry().cell_m * (rise_x + rise_y);
  out->variance = mean(&Cell::variance);
  out->covariance = {mean(&Cell::covariance_x), mean(&Cell::covariance_y)};
  return true;
}

}  // namespace seastitch
