#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "mapper/registration/cell_pairs.hpp"

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;

// Factor of variance above which the soundings of a cell scatter because of structure finer than
// the cell, such as a pipe or a wreck, and not by chance.
constexpr double kClearScatter = 4.0;
// Edge of a block [m]. Residuals inside a block vary only by the noise of soundings.
constexpr double kScatterBlockM = 10.0;

// Derivatives of the gradient by the cells' heights, of one of the two submaps.
class Shares {
 public:
  explicit Shares(const Grid<Cell>& grid)
      : grid_(grid), shares_(grid.geometry().size(), Share::Zero()) {
    columns_.resize(static_cast<std::size_t>(grid.geometry().rows));
  }

  // share: derivative of the gradient by the height of this cell.
  void Add(int row, int col, const Eigen::Array4f& share) {
    const std::size_t i = grid_.geometry().Index(row, col);
    const Cell& cell = grid_.cells()[i];
    shares_[i] += share * (cell.variance / cell.noise);
    ColumnSpan& columns = columns_[static_cast<std::size_t>(row)];
    columns = columns.Union({col, col + 1});
  }

  // Covariance of the gradient from the soundings' scatter: from their noise, for a variance of 1
  // m2, and from structure finer than a cell.
  struct BySoundings {
    Eigen::Matrix4d noise = Eigen::Matrix4d::Zero();
    Eigen::Matrix4d structure = Eigen::Matrix4d::Zero();
  };
  // Sum over soundings of variance u u^T, where u is the derivative of the gradient by one
  // sounding: the cells' shares, smoothed as the heights were. A cell counts as structure if its
  // scatter is clearly more than `variance` times its noise.
  BySoundings OfSoundings(double variance) const {
    const GridGeometry& g = grid_.geometry();
    BySoundings sum;
    const auto load = [&](int row, Share* line) {
      const ColumnSpan columns = columns_[static_cast<std::size_t>(row)];
      for (int col = columns.first; col < columns.last; ++col)
        line[col] = shares_[g.Index(row, col)];
      return columns;
    };
    SmoothRows<Share>(g.rows, g.cols, load, [&](int row, ColumnSpan columns, const Share* line) {
      for (int col = columns.first; col < columns.last; ++col) {
        const Cell& cell = grid_(row, col);
        if (cell.soundings == 0.0f) continue;
        const double shown = static_cast<double>(cell.scatter);
        const double noise = static_cast<double>(cell.noise);
        const bool is_structure = shown > kClearScatter * variance * noise;
        Eigen::Matrix4d& part = is_structure ? sum.structure : sum.noise;
        const Eigen::Vector4d u = line[col].matrix().cast<double>();
        part.noalias() += (cell.soundings * (is_structure ? shown : noise) * u) * u.transpose();
      }
    });
    return sum;
  }

 private:
  using Share = Eigen::Array4f;
  const Grid<Cell>& grid_;
  std::vector<Share> shares_;
  std::vector<ColumnSpan> columns_;
};

// Residuals by block. Their variance within blocks is that of soundings.
class ResidualScatter {
 public:
  explicit ResidualScatter(double cell_m)
      : block_m_(std::max(kScatterBlockM, 3.0 * std::sqrt(kPatchCells) * cell_m)) {}

  void Add(const CellPair& p, double robust_weight) {
    const Key here{static_cast<int>(std::floor(p.arm.x() / block_m_)),
                   static_cast<int>(std::floor(p.arm.y() / block_m_))};
    if (last_ == nullptr || here != last_key_) last_ = &blocks_[last_key_ = here];
    last_->residuals.Add(robust_weight / p.variance_both, p.residual);
    last_->cells += 1.0;
  }

  SoundingScatter Finish(double prior_variance, double least_variance) const {
    double within = 0.0;
    double degrees = 0.0;
    for (const auto& [key, block] : blocks_) {
      if (block.cells < 2.0 * kPatchCells) continue;
      within += block.residuals.weight * block.residuals.Variance();
      degrees += (block.cells - kPatchCells) / kPatchCells;
    }
    return {prior_variance, degrees > 0.0 ? within / degrees : 0.0, degrees, least_variance};
  }

 private:
  using Key = std::pair<int, int>;
  struct Block {
    WeightedMoments residuals;  // weighted by inverse variance
    double cells = 0.0;
  };
  double block_m_;
  std::map<Key, Block> blocks_;
  Key last_key_;
  // block of last_key_: most cells are in the same block as the cell before
  Block* last_ = nullptr;
};

}  // namespace

AlignmentInformation GridAligner::Inform(const Alignment& fit) const {
  ResidualScatter scatter(source_.cell_m());
  OverlapBlocks blocks(source_.cell_m());
  Shares source_shares(source_.grid);
  Shares target_shares(target_.grid);
  const NormalEquations n =
      Accumulate(fit.at,
                 fit.noise_scale,
                 [&](const CellPair& p,
                     double psi,
                     const Eigen::Vector4d& J,
                     const Eigen::Vector3d& apart,
                     const Eigen::Vector4d& pull) {
                   const double w = p.weight * psi;
                   scatter.Add(p, psi);
                   blocks.Add(p.arm, w, p.variance_both, J, apart, pull);
                   const Eigen::Array4f share = (w * J).cast<float>().array();
                   source_shares.Add(p.row, p.col, share);
                   for (int i = 0; i < 2; ++i)
                     for (int j = 0; j < 2; ++j)
                       target_shares.Add(p.around.row + i,
                                         p.around.col + j,
                                         share * static_cast<float>(p.around.Part(i, j)));
                 });

  AlignmentInformation out;
  out.scatter = scatter.Finish(noise_.scatter_m * noise_.scatter_m,
                               params_.min_sounding_sigma_m * params_.min_sounding_sigma_m);
  const double sounding_variance = out.scatter.VarianceUnder(noise_.components);
  const Shares::BySoundings by_source = source_shares.OfSoundings(sounding_variance);
  const Shares::BySoundings by_target = target_shares.OfSoundings(sounding_variance);
  out.structure = by_source.structure + by_target.structure;
  const Eigen::Matrix4d unit_white = by_source.noise + by_target.noise;
  const Eigen::Matrix4d white = sounding_variance * unit_white + out.structure;
  const Eigen::Matrix2d R = fit.at.T_target_source.Rotation();
  out.blocks = blocks.Finish(white, sounding_variance, fit.at.T_target_source, center_source_);
  out.sources = GradientCovarianceOf(out.blocks, R);
  out.sources.white = unit_white;

  out.shift_information = 1.0 / (prior_.z_sigma_m * prior_.z_sigma_m);
  const VarianceComponents& c = noise_.components;
  Eigen::Matrix4d B = white + shared_variance_ * out.sources.correlated_error +
                      c.position_walk * c.position_walk * out.sources.position_walk +
                      c.heading_walk * c.heading_walk * out.sources.heading_walk;
  B(3, 3) += out.shift_information;
  Eigen::Matrix4d cross = n.HessianCross();
  cross(3, 3) += out.shift_information;
  Eigen::Vector4d gradient = n.gradient;
  gradient[3] -= out.shift_information * fit.at.shift_m;

  out.eliminate.setIdentity();
  out.eliminate.col(3) = -cross.topRightCorner<3, 1>() / cross(3, 3);
  out.shift_step_m = gradient[3] / cross(3, 3);
  out.hessian = (out.eliminate * cross).leftCols<3>();
  out.noise_hessian = 0.5 * n.hessian_apart;
  out.gradient = out.eliminate * gradient;
  out.gradient_covariance = out.eliminate * B * out.eliminate.transpose();
  out.sounding_sigma_m = std::sqrt(sounding_variance);
  out.shared_sigma_m = std::sqrt(shared_variance_);
  out.shift_sigma_m = std::sqrt(B(3, 3)) / cross(3, 3);
  return out;
}

}  // namespace seastitch
