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
  // Weight of the central cell in two dimensions.
  double Peak() const { return weight[kKernelRadius] * weight[kKernelRadius]; }
  static constexpr std::size_t Tap(int t) { return static_cast<std::size_t>(t + kKernelRadius); }
};

// Columns [first, last) of a row.
struct ColumnSpan {
  int first = 0;
  int last = 0;
  bool empty() const { return first >= last; }
  ColumnSpan Union(const ColumnSpan& other) const {
    if (empty()) return other;
    if (other.empty()) return *this;
    return {std::min(first, other.first), std::max(last, other.last)};
  }
};

// Smooths rows x cols values row by row, so that no more than seven rows are held; outside is zero.
// load(row, line) writes the values of a row into a line of zeros and returns the columns that it
// wrote; visit(row, columns, line) gets the row smoothed, which is zero but on `columns`. Each row
// is loaded once, in order, before it is visited. Value: an Eigen array of fixed size.
template <class Value, class Load, class Visit>
void SmoothRows(int rows, int cols, Load load, Visit visit) {
  using Scalar = typename Value::Scalar;
  constexpr int kSlots = 2 * kKernelRadius + 1;
  const SmoothingKernel kernel;
  const Value zero = Value::Zero();
  const auto width = static_cast<std::size_t>(cols);
  const auto weight = [&](int t) { return static_cast<Scalar>(kernel.weight[kernel.Tap(t)]); };
  static_assert(kKernelRadius == 3);
  const Scalar w0 = weight(0), w1 = weight(1), w2 = weight(2), w3 = weight(3);

  // Lines smoothed along themselves, the last seven of them.
  std::vector<Value> ring(kSlots * width, zero);
  std::array<ColumnSpan, kSlots> spans;
  const auto slot = [](int row) { return static_cast<std::size_t>((row + kSlots) % kSlots); };
  std::vector<Value> padded(width + 2 * kKernelRadius, zero);
  const auto push = [&](int row) {
    Value* line = ring.data() + slot(row) * width;
    std::fill_n(line, width, zero);
    spans[slot(row)] = {};
    if (row >= rows) return;
    std::fill(padded.begin(), padded.end(), zero);
    const ColumnSpan loaded = load(row, padded.data() + kKernelRadius);
    if (loaded.empty()) return;
    spans[slot(row)] = {std::max(0, loaded.first - kKernelRadius),
                        std::min(cols, loaded.last + kKernelRadius)};
    for (int col = spans[slot(row)].first; col < spans[slot(row)].last; ++col) {
      const Value* m = padded.data() + col + kKernelRadius;
      Value sum = m[0] * w0 + (m[-1] + m[1]) * w1 + (m[-2] + m[2]) * w2;
      sum += (m[-3] + m[3]) * w3;
      line[col] = sum;
    }
  };

  std::vector<Value> smoothed(width, zero);
  for (int row = 0; row < kKernelRadius; ++row) push(row);
  for (int row = 0; row < rows; ++row) {
    push(row + kKernelRadius);
    ColumnSpan span;
    for (const ColumnSpan& s : spans) span = span.Union(s);
    std::array<const Value*, kSlots> m;
    for (int t = -kKernelRadius; t <= kKernelRadius; ++t)
      m[kernel.Tap(t)] = ring.data() + slot(row + t) * width;
    for (int col = span.first; col < span.last; ++col) {
      Value sum = m[3][col] * w0 + (m[2][col] + m[4][col]) * w1 + (m[1][col] + m[5][col]) * w2;
      sum += (m[0][col] + m[6][col]) * w3;
      smoothed[static_cast<std::size_t>(col)] = sum;
    }
    visit(row, span, smoothed.data());
  }
}

}  // namespace seastitch
