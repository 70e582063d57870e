#include "mapper/registration/local_noise.hpp"
#include "common/core/median.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;
using Level = RegistrationSubmap::Level;

// Cells per side of a block. Every second cell in both directions is used, because the kernel mixes
// neighbours. The median of so many cells is the noise even if a pipe or a wreck, which is finer
// than a cell and scatters more, crosses the block.
constexpr int kBlockCells = 8;
constexpr int kStride = 2;
constexpr std::size_t kFewest = 3;
// Limits of a block's variance relative to the typical block. Values beyond are not noise of one
// sonar.
constexpr float kLeast = 0.05f;
constexpr float kMost = 16.0f;
// Largest change of the logarithm of the variance from the middle of a block.
constexpr float kFurthest = 1.0f;

bool IsKnown(const Cell& cell) { return cell.variance > 0.0f; }

}  // namespace

LocalNoise::LocalNoise(const Level& finest, double least_sigma_m)
    : blocks_(BlocksOf(finest, least_sigma_m)) {
  std::vector<float> known;
  for (const Block& block : blocks_.cells())
    if (block.variance > 0.0f) known.push_back(block.variance);
  if (known.empty()) return;
  typical_ = Median(std::move(known));
  for (int row = 0; row < blocks_.geometry().rows; ++row)
    for (int col = 0; col < blocks_.geometry().cols; ++col)
      if (blocks_(row, col).variance > 0.0f) blocks_(row, col).gradient = GradientAt(row, col);
  Grid<Block> filled = blocks_;
  for (int row = 0; row < blocks_.geometry().rows; ++row)
    for (int col = 0; col < blocks_.geometry().cols; ++col)
      if (blocks_(row, col).variance == 0.0f) filled(row, col) = NearestTo(row, col);
  blocks_ = std::move(filled);
}

Grid<LocalNoise::Block> LocalNoise::BlocksOf(const Level& finest, double least_sigma_m) {
  const GridGeometry& g = finest.grid.geometry();
  const auto least = static_cast<float>(least_sigma_m * least_sigma_m);
  const auto cell_m = static_cast<float>(g.cell_m);
  const auto blocks = [](int n) { return (n + kBlockCells - 1) / kBlockCells; };
  Grid<Block> out({g.origin, kBlockCells * g.cell_m, blocks(g.rows), blocks(g.cols)});
  std::vector<float> scatters;
  for (int block_row = 0; block_row < out.geometry().rows; ++block_row) {
    for (int block_col = 0; block_col < out.geometry().cols; ++block_col) {
      Block& block = out(block_row, block_col);
      const int end_row = std::min(g.rows, kBlockCells * (block_row + 1));
      const int end_col = std::min(g.cols, kBlockCells * (block_col + 1));
      Eigen::Vector2f sum = Eigen::Vector2f::Zero();
      scatters.clear();
      for (int row = kBlockCells * block_row; row < end_row; row += kStride) {
        for (int col = kBlockCells * block_col; col < end_col; col += kStride) {
          if (!IsKnown(finest.grid(row, col))) continue;
          scatters.push_back(finest.grid(row, col).scatter);
          sum += Eigen::Vector2f(static_cast<float>(row) + 0.5f, static_cast<float>(col) + 0.5f);
        }
      }
      if (scatters.size() < kFewest) continue;
      block.middle = cell_m * sum / static_cast<float>(scatters.size());
      block.variance = std::max(least, Median(scatters));
    }
  }
  return out;
}

// Gradient of the logarithm of the variance, by least squares over the neighbouring blocks. The
// constant on the diagonal shrinks a poorly determined gradient towards zero.
Eigen::Vector2f LocalNoise::GradientAt(int row, int col) const {
  const Block& here = blocks_(row, col);
  const auto block_m = static_cast<float>(blocks_.geometry().cell_m);
  Eigen::Matrix2f squares = Eigen::Matrix2f::Identity() * (0.1f * block_m * block_m);
  Eigen::Vector2f products = Eigen::Vector2f::Zero();
  for (int r = row - 1; r <= row + 1; ++r) {
    for (int c = col - 1; c <= col + 1; ++c) {
      if (!blocks_.geometry().Contains(r, c) || blocks_(r, c).variance == 0.0f) continue;
      const Eigen::Vector2f apart = blocks_(r, c).middle - here.middle;
      squares += apart * apart.transpose();
      products += apart * std::log(blocks_(r, c).variance / here.variance);
    }
  }
  return squares.inverse() * products;
}

// The nearest of the neighbouring blocks with a known variance. Used at the rim of a submap, where
// blocks are too small to have one.
LocalNoise::Block LocalNoise::NearestTo(int row, int col) const {
  const Eigen::Vector2f middle =
      (blocks_.geometry().Center(row, col) - blocks_.geometry().origin).cast<float>();
  Block nearest;
  for (int r = row - 1; r <= row + 1; ++r) {
    for (int c = col - 1; c <= col + 1; ++c) {
      if (!blocks_.geometry().Contains(r, c) || blocks_(r, c).variance == 0.0f) continue;
      if (nearest.variance == 0.0f ||
          (blocks_(r, c).middle - middle).squaredNorm() < (nearest.middle - middle).squaredNorm())
        nearest = blocks_(r, c);
    }
  }
  return nearest;
}

LocalNoise::Noise LocalNoise::At(const Block& block, const Eigen::Vector2f& p) const {
  const float grown = block.gradient.dot(p - block.middle);
  const float ratio =
      block.variance / typical_ * std::exp(std::clamp(grown, -kFurthest, kFurthest));
  const float bounded = std::clamp(ratio, kLeast, kMost);
  if (bounded != ratio || std::abs(grown) > kFurthest) return {bounded, Eigen::Vector2f::Zero()};
  return {ratio, ratio * block.gradient};
}

void LocalNoise::Weigh(Level* level) const {
  if (typical_ == 0.0f) return;
  const GridGeometry& g = level->grid.geometry();
  const GridGeometry& b = blocks_.geometry();
  std::vector<int> block_cols;
  for (int col = 0; col < g.cols; ++col)
    block_cols.push_back(std::clamp(b.Col(g.Center(0, col).y()), 0, b.cols - 1));
  for (int row = 0; row < g.rows; ++row) {
    const int block_row = std::clamp(b.Row(g.Center(row, 0).x()), 0, b.rows - 1);
    for (int col = 0; col < g.cols; ++col) {
      Cell& cell = level->grid(row, col);
      const Block& block = blocks_(block_row, block_cols[static_cast<std::size_t>(col)]);
      if (!IsKnown(cell) || block.variance == 0.0f) continue;
      const Noise noise = At(block, (g.Center(row, col) - b.origin).cast<float>());
      // A noise that grows across a kernel K correlates height and slope, as a rim does. Errors are
      // weighted by K^2, which has half the spread of K.
      const Eigen::Vector2f by_growth = 0.5f * cell.variance * noise.gradient;
      cell.noise = noise.ratio;
      cell.variance *= noise.ratio;
      cell.covariance_x = noise.ratio * cell.covariance_x + by_growth.x();
      cell.covariance_y = noise.ratio * cell.covariance_y + by_growth.y();
    }
  }
}

}  // namespace seastitch
