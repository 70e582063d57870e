#include "mapper/calibration/overlap_rows.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/mounting.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMinCells = 20;
// Height error of a cell that no number of soundings averages out.
constexpr double kFloorM = 0.002;
constexpr double kHuber = 2.0;
constexpr double kCut = 6.0;
constexpr int kRobustRounds = 4;
// The scatter in a cell, less what its degrees of freedom hide.
constexpr double kMedianToMean = 1.1;
// Of normally distributed errors.
constexpr double kSigmaByMedian = 1.4826;
constexpr std::size_t kEnoughSamples = 30;
constexpr double kUnknownVariance_m2 = 0.01 * 0.01;
constexpr double kWidestAngle_rad = Deg2Rad(65.0);

Eigen::Vector2d PlaceOf(const CalibrationCell& cell, double shear_rad) {
  const Eigen::Vector2d p(cell.mean_m[0], cell.mean_m[1]);
  return p + Shear(p, shear_rad);
}

double VarianceOf(const CalibrationCell& cell, const SoundingNoise& noise) {
  return noise.VarianceAt(cell.angle_rad) / cell.soundings;
}

// Change of a cell's height by the errors of its submap.
Eigen::Matrix<double, kSubmapErrors, 1> BySubmap(const CalibrationCell& cell) {
  const double gx = cell.slope[0], gy = cell.slope[1];
  const auto by_error = [&](IntegrationError error) {
    return double{cell.by_error[static_cast<std::size_t>(error)]};
  };
  const double by_roll =
      by_error(IntegrationError::kRoll) + by_error(IntegrationError::kSecondHeadRoll);
  Eigen::Matrix<double, kSubmapErrors, 1> by;
  by << -gx, -gy, 1.0, gx * cell.mean_m[1] - gy * cell.mean_m[0], by_roll,
      by_error(IntegrationError::kPitch);
  return by;
}

OverlapRow RowOf(const CalibrationCell& target, const CalibrationCell& source) {
  OverlapRow row;
  for (std::size_t k = 0; k < kIntegrationErrors; ++k)
    row.coefficients[static_cast<Eigen::Index>(k)] =
        double{target.by_error[k]} - double{source.by_error[k]};
  row.coefficients.segment<kSubmapErrors>(kIntegrationErrors) = BySubmap(target);
  row.coefficients.tail<kSubmapErrors>() = -BySubmap(source);
  return row;
}

// Trust and weight of each row by its distance from a plane through the differences, robustly.
void Weigh(std::vector<OverlapRow>* rows) {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  for (const OverlapRow& row : *rows) center += row.p_map;
  center /= static_cast<double>(rows->size());
  const auto plane_at = [&](const OverlapRow& row) {
    return Eigen::Vector3d(1.0, row.p_map.x() - center.x(), row.p_map.y() - center.y());
  };
  double spread = 1.0;
  for (int round = 0; round < kRobustRounds; ++round) {
    Eigen::Matrix3d N = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const OverlapRow& row : *rows) {
      const Eigen::Vector3d at = plane_at(row);
      N += row.trust * row.weight * at * at.transpose();
      b += row.trust * row.weight * row.y * at;
    }
    const Eigen::Vector3d plane = N.ldlt().solve(b);
    std::vector<double> distances;
    for (const OverlapRow& row : *rows)
      distances.push_back(std::abs(row.y - plane.dot(plane_at(row))) * std::sqrt(row.weight));
    spread = std::max(kSigmaByMedian * Median(distances), 1e-9);
    for (std::size_t i = 0; i < rows->size(); ++i) {
      const double t = distances[i] / spread;
      (*rows)[i].trust = t < kHuber ? 1.0 : t < kCut ? kHuber / t : 0.0;
    }
  }
  const double by = 1.0 / std::pow(std::max(spread, 1.0), 2);
  for (OverlapRow& row : *rows) row.weight *= by * row.trust;
}

}  // namespace

std::size_t SoundingNoise::BinOf(double angle_rad) {
  const double bin = angle_rad / kWidestAngle_rad * static_cast<double>(kBins);
  return std::min(kBins - 1, static_cast<std::size_t>(std::max(0.0, bin)));
}

void SoundingNoise::Add(const CalibrationCells& cells) {
  constexpr float kEnough = 4.0f;
  constexpr std::size_t kMostSamples = 20'000;
  for (const CalibrationCell& cell : cells.cells) {
    std::vector<float>& samples = samples_[BinOf(cell.angle_rad)];
    if (cell.soundings >= kEnough && samples.size() < kMostSamples)
      samples.push_back(cell.variance_m2);
  }
}

void SoundingNoise::Finish() {
  for (std::size_t i = 0; i < kBins; ++i)
    variance_m2_[i] =
        samples_[i].size() < kEnoughSamples ? 0.0 : kMedianToMean * double{Median(samples_[i])};
}

double SoundingNoise::VarianceAt(double angle_rad) const {
  const double variance_m2 = variance_m2_[BinOf(angle_rad)];
  return variance_m2 > 0.0 ? variance_m2 : kUnknownVariance_m2;
}

std::vector<OverlapRow> RowsOf(const CalibrationCells& target,
                               const CellsPlace& target_place,
                               const CalibrationCells& source,
                               const CellsPlace& source_place,
                               const SoundingNoise& noise) {
  const Pose2 T_target_source = Inverse(target_place.T_map_level) * source_place.T_map_level;
  std::vector<OverlapRow> rows;
  for (const CalibrationCell& cell : source.cells) {
    const Eigen::Vector2d p_target = T_target_source * PlaceOf(cell, source_place.shear_rad);
    // To first order the shear is its own inverse with the other sign.
    const CalibrationCell* there = target.At(p_target + Shear(p_target, -target_place.shear_rad));
    if (there == nullptr) continue;
    const Eigen::Vector2d apart = p_target - PlaceOf(*there, target_place.shear_rad);
    const double target_m = target_place.z_m + there->mean_m[2] +
                            Eigen::Vector2d(there->slope[0], there->slope[1]).dot(apart);
    OverlapRow row = RowOf(*there, cell);
    row.y = source_place.z_m + cell.mean_m[2] - target_m;
    row.weight = 1.0 / (VarianceOf(*there, noise) + VarianceOf(cell, noise) + kFloorM * kFloorM);
    row.trust = 1.0;
    row.p_map = target_place.T_map_level * p_target;
    rows.push_back(row);
  }
  if (rows.size() < kMinCells) return {};
  Weigh(&rows);
  return rows;
}

}  // namespace seastitch
