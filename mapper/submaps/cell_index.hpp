#pragma once

#include <Eigen/Core>
#include <array>
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

// The cell of a coordinate. Points were limited before; coordinates beyond the range of the type
// get the outermost cell.
inline std::int32_t CellOf(double coordinate_m, double cell_m) {
  constexpr double kLimit = 1e9;
  const double cell = std::floor(coordinate_m / cell_m);
  return static_cast<std::int32_t>(cell < -kLimit ? -kLimit : (cell > kLimit ? kLimit : cell));
}

// Numbers cells from 0 in the order in which they are first used. Data per cell can so be stored in
// a vector, in an order that does not depend on a hash. Cells are stored in flat tiles, as the
// seabed is flat. A hash table (open addressing, linear probing) finds the tile; mostly it is not
// needed, because successive soundings are neighbours.
class CellIndex {
 public:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::size_t FindOrAdd(const CellKey& key) {
    const CellKey tile_key = TileOf(key);
    if (tiles_.empty() || tiles_[last_].key != tile_key) last_ = FindOrAddTile(tile_key);
    std::uint32_t& cell = tiles_[last_].cells[InTile(key)];
    if (cell == kEmpty) {
      cell = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
    }
    return cell;
  }

  std::size_t Find(const CellKey& key) const {
    if (slots_.empty()) return kNone;
    const std::uint32_t tile = slots_[SlotOf(TileOf(key))];
    const std::uint32_t cell = tile == kEmpty ? kEmpty : tiles_[tile].cells[InTile(key)];
    return cell == kEmpty ? kNone : cell;
  }

  const std::vector<CellKey>& keys() const { return keys_; }
  std::size_t size() const { return keys_.size(); }

  // A flat tile with a border of cells around it: the number of each cell, or kNoCell. A row is
  // along y.
  static constexpr int kTileSide = 8;
  static constexpr int kBorder = 2;
  static constexpr int kBlockSide = kTileSide + 2 * kBorder;
  static constexpr std::uint32_t kNoCell = 0xffffffff;
  using Block = std::array<std::uint32_t, kBlockSide * kBlockSide>;
  std::size_t tiles() const { return tiles_.size(); }
  Block BlockOf(std::size_t tile) const;

 private:
  static constexpr int kSideBits = 3;
  static constexpr int kSide = 1 << kSideBits;
  static_assert(kSide == kTileSide);
  static constexpr std::uint32_t kEmpty = kNoCell;
  struct Tile {
    CellKey key;
    std::array<std::uint32_t, kSide * kSide> cells;
  };

  static CellKey TileOf(const CellKey& key) {
    return {key.x >> kSideBits, key.y >> kSideBits, key.z};
  }
  static std::size_t InTile(const CellKey& key) {
    return static_cast<std::size_t>((key.x & (kSide - 1)) * kSide + (key.y & (kSide - 1)));
  }

  static std::size_t Hash(const CellKey& key) {
    // Odd multipliers such as 2^64 / phi, then the high bits folded down, so that neighbours spread
    // over the table.
    std::uint64_t h = static_cast<std::uint32_t>(key.x) * 0x9E3779B97F4A7C15ull;
    h ^= static_cast<std::uint32_t>(key.y) * 0xC2B2AE3D27D4EB4Full;
    h ^= static_cast<std::uint32_t>(key.z) * 0x165667B19E3779F9ull;
    return static_cast<std::size_t>(h ^ (h >> 29) ^ (h >> 43));
  }

  // Slot of the tile, or the free slot for it.
  std::size_t SlotOf(const CellKey& tile_key) const {
    std::size_t slot = Hash(tile_key) & (slots_.size() - 1);
    while (slots_[slot] != kEmpty && tiles_[slots_[slot]].key != tile_key)
      slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }

  std::uint32_t FindOrAddTile(const CellKey& tile_key) {
    if (2 * (tiles_.size() + 1) > slots_.size()) Grow();
    std::uint32_t& slot = slots_[SlotOf(tile_key)];
    if (slot == kEmpty) {
      slot = static_cast<std::uint32_t>(tiles_.size());
      tiles_.push_back({tile_key, {}});
      tiles_.back().cells.fill(kEmpty);
    }
    return slot;
  }

  void Grow() {
    slots_.assign(slots_.empty() ? 64 : 2 * slots_.size(), kEmpty);
    for (std::size_t i = 0; i < tiles_.size(); ++i)
      slots_[SlotOf(tiles_[i].key)] = static_cast<std::uint32_t>(i);
  }

  std::vector<CellKey> keys_;
  std::vector<Tile> tiles_;
  std::vector<std::uint32_t> slots_;  // a power of two, at most half full
  std::uint32_t last_ = 0;            // tile of the last cell asked for
};

// The smallest of cell_m, 2 cell_m, 4 cell_m, ... with at least soundings_per_column on average in
// occupied columns. So a filter or an outline adapts to the density of the data. z axis of the
// points: up or down.
double CellForDensity(const std::vector<Eigen::Vector3f>& points,
                      const std::vector<float>& soundings,
                      double cell_m,
                      double soundings_per_column);

}  // namespace seastitch
