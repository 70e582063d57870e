#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

// Gaussian smoothing of a grid by a kernel of one cell sigma, cut off at three.
namespace seastitch {

constexpr int kKernelRadius = 3;

struct SmoothingKernel {
  std::array<double, 2 * kKernelRadius + 1> weight;  // along one axis, sum 1
  double sum_of_squares;                             // along one axis

  SmoothingKernel() {
    double sum = 0.0;
    for (int t = -kKernelRadius; t <= kKernelRadius; ++t) {
      weight[Tap(t)] = std::exp(-0.5 * t * t);
      sum += weight[Tap(t)];
    }
    sum_of_squares = 0.0;
    for (double& w : weight) {
      w /= sum;
      sum_of_squares += w * w;
    }
  }
  // Cells that share their noise: one over the sum of the squared weights of the plane, 4 pi.
  double PatchCells() const { return 1.0 / (sum_of_squares * sum_of_squares); }
  // Of the plane.
  double Peak() const { return weight[kKernelRadius] * weight[kKernelRadius]; }
  static constexpr std::size_t Tap(int t) { return static_cast<std::size_t>(t + kKernelRadius); }
};

// Smooths rows x cols values in place, row by row in `data`; outside is zero. Value: an Eigen array
// of fixed size.
template <class Value>
void Smooth(int rows, int cols, std::vector<Value>* data) {
  using Scalar = typename Value::Scalar;
  const SmoothingKernel kernel;
  const Value zero = Value::Zero();
  const auto width = static_cast<std::size_t>(cols);
  const auto weight = [&](int t) { return static_cast<Scalar>(kernel.weight[kernel.Tap(t)]); };

  std::vector<Value> padded(width + 2 * kKernelRadius, zero);
  for (int row = 0; row < rows; ++row) {
    Value* line = data->data() + static_cast<std::size_t>(row) * width;
    std::copy_n(line, width, padded.begin() + kKernelRadius);
    for (std::size_t col = 0; col < width; ++col) {
      const Value* middle = &padded[col + kKernelRadius];
      Value sum = middle[0] * weight(0);
      for (int t = 1; t <= kKernelRadius; ++t) sum += (middle[-t] + middle[t]) * weight(t);
      line[col] = sum;
    }
  }
  // Down the rows: a ring keeps the lines above as they were.
  std::vector<Value> ring((2 * kKernelRadius + 1) * width, zero);
  const auto slot = [&](int row) {
    constexpr int kSlots = 2 * kKernelRadius + 1;
    return ring.data() + static_cast<std::size_t>((row + kSlots) % kSlots) * width;
  };
  const auto load = [&](int row) {
    if (row < rows)
      std::copy_n(data->data() + static_cast<std::size_t>(row) * width, width, slot(row));
    else
      std::fill_n(slot(row), width, zero);
  };
  for (int row = 0; row < kKernelRadius; ++row) load(row);
  for (int row = 0; row < rows; ++row) {
    load(row + kKernelRadius);
    std::array<const Value*, 2 * kKernelRadius + 1> lines;
    for (int t = -kKernelRadius; t <= kKernelRadius; ++t) lines[kernel.Tap(t)] = slot(row + t);
    Value* out = data->data() + static_cast<std::size_t>(row) * width;
    for (std::size_t col = 0; col < width; ++col) {
      Value sum = lines[kKernelRadius][col] * weight(0);
      for (int t = 1; t <= kKernelRadius; ++t)
        sum += (lines[kernel.Tap(-t)][col] + lines[kernel.Tap(t)][col]) * weight(t);
      out[col] = sum;
    }
  }
}

}  // namespace seastitch
