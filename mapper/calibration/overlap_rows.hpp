#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/calibration/calibration_cells.hpp"

namespace seastitch {

// Errors of the place and attitude of one submap: x, y, down [m], yaw, roll, pitch [rad], in its
// level frame.
inline constexpr int kSubmapErrors = 6;
inline constexpr int kDownError = 2;
inline constexpr int kRollError = 4;
inline constexpr int kRowSize = static_cast<int>(kIntegrationErrors) + 2 * kSubmapErrors;

// Difference of the heights of one cell as two submaps measured it: y = coefficients . (integration
// errors, errors of the target, errors of the source) + noise.
struct OverlapRow {
  Eigen::Matrix<double, kRowSize, 1> coefficients;
  double y = 0.0;       // [m], down: what has to be added to target less source
  double weight = 0.0;  // 1 / m2
  double trust = 0.0;   // 0 to 1: robust weight
  Eigen::Vector2d p_map = Eigen::Vector2d::Zero();
};

// Where the cells of a submap belong: its level frame in the map, its depth, and what its cloud is
// sheared by (Shear()).
struct CellsPlace {
  Pose2 T_map_level;
  double z_m = 0.0;
  double shear_rad = 0.0;
};

// Variance of one sounding by its angle from the vertical.
class SoundingNoise {
 public:
  // Learns the scatter of soundings in the cells of a submap.
  void Add(const CalibrationCells& cells);
  // [m2]; 0.01 m squared where nothing is known.
  double VarianceAt(double angle_rad) const;
  void Finish();

 private:
  static constexpr std::size_t kBins = 12;
  static std::size_t BinOf(double angle_rad);
  std::array<std::vector<float>, kBins> samples_;
  std::array<double, kBins> variance_m2_{};
};

// Rows of the cells that two submaps share: the mean of a cell of the source against the plane of
// the target there. Weights are robust against the spread about a plane through the differences.
// Empty with fewer than 20 cells.
std::vector<OverlapRow> RowsOf(const CalibrationCells& target,
                               const CellsPlace& target_place,
                               const CalibrationCells& source,
                               const CellsPlace& source_place,
                               const SoundingNoise& noise);

}  // namespace seastitch
