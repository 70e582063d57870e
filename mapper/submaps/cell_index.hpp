#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace seastitch {

// A cell of a regular grid without borders.
struct CellKey {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  friend bool operator==(const CellKey&, const CellKey&) = default;
};

// The cell of a coordinate. Points are bounded by gates before they come here; what is further
// than the type reaches is put into the outermost cell.
inline std::int32_t CellOf(double coordinate_m, double cell_m) {
  constexpr double kLimit = 1e9;
  const double cell = std::floor(coordinate_m / cell_m);
  return static_cast<std::int32_t>(cell < -kLimit ? -kLimit : (cell > kLimit ? kLimit : cell));
}

// Numbers cells from 0 in the order in which they are first seen, so that whatever is kept a cell
// lies in a plain vector and has an order that no hash decides. Open addressing, linear probing.
class CellIndex {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::size_t FindOrAdd(const CellKey& key) {
    if (2 * (keys_.size() + 1) > slots_.size()) Grow();
    std::size_t slot = Hash(key) & mask_;
    while (slots_[slot] != kEmpty) {
      if (keys_[slots_[slot]] == key) return slots_[slot];
      slot = (slot + 1) & mask_;
    }
    slots_[slot] = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(key);
    return keys_.size() - 1;
  }

  std::size_t Find(const CellKey& key) const {
    if (slots_.empty()) return kNone;
    std::size_t slot = Hash(key) & mask_;
    while (slots_[slot] != kEmpty) {
      if (keys_[slots_[slot]] == key) return slots_[slot];
      slot = (slot + 1) & mask_;
    }
    return kNone;
  }

  const std::vector<CellKey>& keys() const { return keys_; }
  std::size_t size() const { return keys_.size(); }

 private:
  static constexpr std::uint32_t kEmpty = 0xffffffff;

  static std::size_t Hash(const CellKey& key) {
    // Odd multipliers near 2^64 / phi and its like, then the high bits folded down: neighbours
    // spread over the table.
    std::uint64_t h = static_cast<std::uint32_t>(key.x) * 0x9E3779B97F4A7C15ull;
    h ^= static_cast<std::uint32_t>(key.y) * 0xC2B2AE3D27D4EB4Full;
    h ^= static_cast<std::uint32_t>(key.z) * 0x165667B19E3779F9ull;
    return static_cast<std::size_t>(h ^ (h >> 29) ^ (h >> 43));
  }

  void Grow() {
    slots_.assign(slots_.empty() ? 1024 : 2 * slots_.size(), kEmpty);
    mask_ = slots_.size() - 1;
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      std::size_t slot = Hash(keys_[i]) & mask_;
      while (slots_[slot] != kEmpty) slot = (slot + 1) & mask_;
      slots_[slot] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<CellKey> keys_;
  std::vector<std::uint32_t> slots_;
  std::size_t mask_ = 0;
};

// The smallest of cell_m, 2 cell_m, 4 cell_m, ... whose occupied columns hold at least
// soundings_per_column on average: what makes a filter or an outline follow the density of the
// data instead of one sonar at one altitude. Axes of the points: z up or down.
double CellForDensity(const std::vector<Eigen::Vector3f>& points,
                      const std::vector<float>& soundings,
                      double cell_m,
                      double soundings_per_column);

}  // namespace seastitch
