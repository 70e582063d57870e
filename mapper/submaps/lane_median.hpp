#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace seastitch {

// Eight numbers that are computed with beside each other: the processor has instructions for it.
constexpr int kLanes = 8;
using Lanes = Eigen::Array<float, kLanes, 1>;

// Pairs of places, compared and exchanged in this order, that bring the median of N values to place
// N / 2: Batcher's odd-even merge sort without what the median does not need.
template <std::size_t N>
class MedianNetwork {
 public:
  struct Pair {
    std::uint8_t low, high;
  };
  constexpr MedianNetwork() {
    std::array<Pair, kMost> all{};
    std::size_t count = 0;
    for (std::size_t p = 1; p < N; p *= 2)
      for (std::size_t k = p; k >= 1; k /= 2)
        for (std::size_t j = k % p; j + k < N; j += 2 * k)
          for (std::size_t i = 0; i < k && i + j + k < N; ++i)
            if ((i + j) / (2 * p) == (i + j + k) / (2 * p))
              all[count++] = {static_cast<std::uint8_t>(i + j),
                              static_cast<std::uint8_t>(i + j + k)};
    std::array<bool, N> is_needed{};
    is_needed[N / 2] = true;
    std::size_t first = kMost;
    while (count > 0) {
      const Pair pair = all[--count];
      if (!is_needed[pair.low] && !is_needed[pair.high]) continue;
      is_needed[pair.low] = is_needed[pair.high] = true;
      pairs_[--first] = pair;
    }
    first_ = first;
  }
  constexpr const Pair* begin() const { return pairs_.data() + first_; }
  constexpr const Pair* end() const { return pairs_.data() + kMost; }

 private:
  static constexpr std::size_t kMost = 8 * N;
  static_assert(N <= 32);
  std::array<Pair, kMost> pairs_{};
  std::size_t first_ = 0;
};

// Median of the numbers of each lane without those that are NaN: of an even number of them the
// upper one, of none 0. Sorts `values`.
template <std::size_t N>
Lanes UpperMedians(std::array<Lanes, N>* values) {
  static constexpr MedianNetwork<N> kNetwork;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Lanes missing = Lanes::Zero();
  for (const Lanes& value : *values)
    for (int lane = 0; lane < kLanes; ++lane)
      missing[lane] += value[lane] == value[lane] ? 0.0f : 1.0f;
  if ((missing > 0.0f).any()) {
    // Infinities take the place of those without a number, so many below that the median stays in
    // the middle.
    Lanes below = static_cast<float>(N / 2) - ((static_cast<float>(N) - missing) * 0.5f).floor();
    for (Lanes& value : *values) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const bool is_missing = !(value[lane] == value[lane]);
        const float infinity = below[lane] > 0.0f ? -kInfinity : kInfinity;
        value[lane] = is_missing ? infinity : value[lane];
        below[lane] -= is_missing ? 1.0f : 0.0f;
      }
    }
  }
  for (const auto& [low, high] : kNetwork) {
    const Lanes a = (*values)[low], b = (*values)[high];
    (*values)[low] = a.min(b);
    (*values)[high] = a.max(b);
  }
  return (missing < static_cast<float>(N)).select((*values)[N / 2], 0.0f);
}

}  // namespace seastitch
