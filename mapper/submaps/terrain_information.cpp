#include "mapper/submaps/terrain_information.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace seastitch {
namespace {

Eigen::Matrix3d WithoutNegativePart(const Eigen::Matrix3d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(symmetric);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
         solver.eigenvectors().transpose();
}

}  // namespace

void TerrainInformation::Add(const Eigen::Vector3d& p, double soundings, double variance_m2) {
  const std::size_t i = index_.FindOrAdd({CellOf(p.x(), cell_m_), CellOf(p.y(), cell_m_), 0});
  if (i == cells_.size()) cells_.emplace_back();
  Cell& cell = cells_[i];
  cell.soundings += soundings;
  cell.sum_height += soundings * p.z();
  cell.sum_variance += soundings * variance_m2;
}

const TerrainInformation::Cell* TerrainInformation::At(const CellKey& key, int dx, int dy) const {
  const std::size_t i = index_.Find({key.x + dx, key.y + dy, 0});
  return i == CellIndex::kNone ? nullptr : &cells_[i];
}

Eigen::Matrix3d TerrainInformation::Evaluate(const Pose2& frame) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d with_height = Eigen::Vector3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  double weights = 0.0;
  double used = 0.0;
  const Pose2 T_frame_axes = Inverse(frame);
  const Eigen::Matrix2d R = T_frame_axes.Rotation();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const CellKey& key = index_.keys()[i];
    const Cell* const north = At(key, 1, 0);
    const Cell* const south = At(key, -1, 0);
    const Cell* const east = At(key, 0, 1);
    const Cell* const west = At(key, 0, -1);
    if (north == nullptr || south == nullptr || east == nullptr || west == nullptr) continue;

    const Eigen::Vector2d slope =
        R * Eigen::Vector2d(north->Height() - south->Height(), east->Height() - west->Height()) /
        (2.0 * cell_m_);
    const Eigen::Vector2d slope_variance =
        Eigen::Vector2d(north->HeightVariance() + south->HeightVariance(),
                        east->HeightVariance() + west->HeightVariance()) /
        (4.0 * cell_m_ * cell_m_);
    const Eigen::Vector2d p =
        T_frame_axes * Eigen::Vector2d((key.x + 0.5) * cell_m_, (key.y + 0.5) * cell_m_);

    Eigen::Matrix<double, 3, 2> J_slope = Eigen::Matrix<double, 3, 2>::Zero();
    J_slope.topRows<2>().setIdentity();
    J_slope(2, 0) = -p.y();
    J_slope(2, 1) = p.x();
    const Eigen::Vector3d J = J_slope * slope;
    const double weight = 0.5 / cells_[i].HeightVariance();
    sum += weight * J * J.transpose();
    with_height += weight * J;
    noise +=
        weight * J_slope * R * slope_variance.asDiagonal() * R.transpose() * J_slope.transpose();
    weights += weight;
    used += 1.0;
  }
  if (used < 1.0) return Eigen::Matrix3d::Zero();
  // The noise estimate has a relative scatter of sqrt(2 / cells). Only what exceeds it by three
  // sigmas counts as relief.
  const double margin = 1.0 + 3.0 * std::sqrt(2.0 / used);
  return WithoutNegativePart(sum - with_height * with_height.transpose() / weights -
                             margin * noise);
}

Eigen::Matrix3d PredictInformation(const PointCloud& level, double voxel_m, double sigma_m) {
  constexpr double kSoundingsPerCell = 6.0;
  TerrainInformation terrain(
      CellForDensity(level.points, level.soundings, 2.0 * voxel_m, kSoundingsPerCell));
  for (std::size_t i = 0; i < level.size(); ++i) {
    if (!(level.soundings[i] > 0.0f)) continue;
    terrain.Add(
        level.points[i].cast<double>(), static_cast<double>(level.soundings[i]), sigma_m * sigma_m);
  }
  return terrain.Evaluate({});
}

}  // namespace seastitch
