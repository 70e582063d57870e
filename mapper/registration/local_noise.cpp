#include "mapper/registration/local_noise.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;

// Cells of a block, of which every second in both directions is asked: the kernel has their
// neighbours too. The median of so many is that of the noise where a pipe or a wreck, which scatter
// because the seabed there is finer than a cell, runs through them.
constexpr int kBlockCells = 8;
constexpr int kStride = 2;
constexpr std::size_t kFewest = 3;
// Times that of the typical block: more or less is no noise of one sonar.
constexpr float kLeast = 0.05f;
constexpr float kMost = 50.0f;

bool IsKnown(const Cell& cell) { return cell.variance > 0.0f; }

float Median(std::vector<float>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

struct Block {
  float scatter = 0.0f;                                // of its known cells; 0: too few
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();    // of these: row, column
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();  // of the logarithm, a row and a column

  float At(int row, int col) const {
    const Eigen::Vector2f from_middle(static_cast<float>(row) - middle.x(),
                                      static_cast<float>(col) - middle.y());
    return scatter * std::exp(std::clamp(gradient.dot(from_middle), -1.0f, 1.0f));
  }
};

Block BlockOf(const Grid<Cell>& cells, int first_row, int first_col, std::vector<float>* scatters) {
  const int end_row = std::min(cells.geometry().rows, first_row + kBlockCells);
  const int end_col = std::min(cells.geometry().cols, first_col + kBlockCells);
  Block block;
  scatters->clear();
  for (int row = first_row; row < end_row; row += kStride) {
    for (int col = first_col; col < end_col; col += kStride) {
      if (!IsKnown(cells(row, col))) continue;
      scatters->push_back(cells(row, col).scatter);
      block.middle += Eigen::Vector2f(static_cast<float>(row), static_cast<float>(col));
    }
  }
  if (scatters->size() < kFewest) return Block();
  block.middle /= static_cast<float>(scatters->size());
  block.scatter = Median(scatters);
  return block;
}

Grid<Block> BlocksOf(const Grid<Cell>& cells) {
  const GridGeometry& g = cells.geometry();
  const auto blocks = [](int n) { return (n + kBlockCells - 1) / kBlockCells; };
  Grid<Block> out({g.origin, kBlockCells * g.cell_m, blocks(g.rows), blocks(g.cols)});
  std::vector<float> scatters;
  for (int row = 0; row < out.geometry().rows; ++row)
    for (int col = 0; col < out.geometry().cols; ++col)
      out(row, col) = BlockOf(cells, kBlockCells * row, kBlockCells * col, &scatters);
  return out;
}

// By least squares over the blocks around; where these tell little, towards nothing.
Eigen::Vector2f GradientAt(const Grid<Block>& blocks, int row, int col) {
  const Block& here = blocks(row, col);
  Eigen::Matrix2f squares = Eigen::Matrix2f::Identity() * (0.1f * kBlockCells * kBlockCells);
  Eigen::Vector2f products = Eigen::Vector2f::Zero();
  for (int r = row - 1; r <= row + 1; ++r) {
    for (int c = col - 1; c <= col + 1; ++c) {
      if (!blocks.geometry().Contains(r, c) || blocks(r, c).scatter == 0.0f) continue;
      const Eigen::Vector2f apart = blocks(r, c).middle - here.middle;
      squares += apart * apart.transpose();
      products += apart * std::log(blocks(r, c).scatter / here.scatter);
    }
  }
  return squares.inverse() * products;
}

}  // namespace

void WeighByLocalNoise(RegistrationSubmap::Level* level) {
  Grid<Block> blocks = BlocksOf(level->grid);
  std::vector<float> scatters;
  for (const Block& block : blocks.cells())
    if (block.scatter > 0.0f) scatters.push_back(block.scatter);
  if (scatters.empty()) return;
  const float typical = Median(&scatters);
  for (int row = 0; row < blocks.geometry().rows; ++row)
    for (int col = 0; col < blocks.geometry().cols; ++col)
      if (blocks(row, col).scatter > 0.0f) blocks(row, col).gradient = GradientAt(blocks, row, col);

  const GridGeometry& g = level->grid.geometry();
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      Cell& cell = level->grid(row, col);
      const Block& block = blocks(row / kBlockCells, col / kBlockCells);
      if (!IsKnown(cell) || block.scatter == 0.0f) continue;
      cell.noise = std::clamp(block.At(row, col) / typical, kLeast, kMost);
      cell.variance *= cell.noise;
      // Noise that grows across a kernel K correlates height and slope as a rim does: K^2, which
      // weighs it, has half the spread of K.
      const Eigen::Vector2f grows = block.gradient / static_cast<float>(g.cell_m);
      cell.covariance_x = cell.noise * cell.covariance_x + 0.5f * cell.variance * grows.x();
      cell.covariance_y = cell.noise * cell.covariance_y + 0.5f * cell.variance * grows.y();
    }
  }
}

}  // namespace seastitch
