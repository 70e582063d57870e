#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/submap.hpp"
#include "mapper/submaps/cell_index.hpp"

namespace seastitch {

// Predicted information of a registration of a piece of seabed about x, y and yaw (Cramer-Rao
// bound): the sum of J^T J / sigma^2 over the soundings, J = (s_x, s_y, x s_y - y s_x) with the
// slopes s and yaw about the frame, halved because the other submap has the same noise. Subtracted
// are the information for the unknown height between the two, and that of the noise of the slopes,
// which would make a flat seabed look like relief.
class TerrainInformation {
 public:
  explicit TerrainInformation(double cell_m) : cell_m_(cell_m) {}

  // `soundings` soundings at a place of mean height z, each with this variance. Axes: any with z
  // up or down; Evaluate() takes the place of the frame in them.
  void Add(const Eigen::Vector3d& p, double soundings, double variance_m2);

  // Information about (x, y [m], yaw [rad]) of the frame, in its own axes. Positive semidefinite;
  // zero where slopes do not stand out of the noise.
  Eigen::Matrix3d Evaluate(const Pose2& frame) const;

  double cell_m() const { return cell_m_; }
  std::size_t cells() const { return cells_.size(); }

 private:
  struct Cell {
    double soundings = 0.0;
    double sum_height = 0.0;
    double sum_variance = 0.0;

    double Height() const { return sum_height / soundings; }
    double HeightVariance() const { return sum_variance / (soundings * soundings); }
  };
  const Cell* At(const CellKey& key, int dx, int dy) const;

  double cell_m_;
  CellIndex index_;
  std::vector<Cell> cells_;
};

// The same for a finished level cloud (LevelCloud()), about the frame's origin. sigma_m: of one
// sounding.
Eigen::Matrix3d PredictInformation(const PointCloud& level, double voxel_m, double sigma_m);

}  // namespace seastitch
