#include "mapper/submaps/cell_index.hpp"

#include <algorithm>
#include <utility>

namespace seastitch {

CellIndex::Block CellIndex::BlockOf(std::size_t tile) const {
  Block block;
  const CellKey& key = tiles_[tile].key;
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      const std::uint32_t from = slots_[SlotOf({key.x + dx, key.y + dy, key.z})];
      // The block's rows and columns that lie in this tile.
      const auto begin = [](int d) { return d < 0 ? 0 : kBorder + d * kTileSide; };
      const auto end = [](int d) { return std::min(kBlockSide, kBorder + (d + 1) * kTileSide); };
      for (int x = begin(dx); x < end(dx); ++x)
        for (int y = begin(dy); y < end(dy); ++y)
          block[static_cast<std::size_t>(x * kBlockSide + y)] =
              from == kEmpty
                  ? kNoCell
                  : tiles_[from].cells[static_cast<std::size_t>(
                        (x - kBorder - dx * kTileSide) * kTileSide + y - kBorder - dy * kTileSide)];
    }
  }
  return block;
}

double CellForDensity(const std::vector<Eigen::Vector3f>& points,
                      const std::vector<float>& soundings,
                      double cell_m,
                      double soundings_per_column) {
  double total = 0.0;
  for (const float n : soundings) total += static_cast<double>(n);
  CellIndex columns;
  for (const Eigen::Vector3f& p : points) {
    columns.FindOrAdd({CellOf(static_cast<double>(p.x()), cell_m),
                       CellOf(static_cast<double>(p.y()), cell_m),
                       0});
  }
  // Ten doublings give a thousand times the first cell. If no cell of that size is dense, none is.
  for (int doubling = 0; doubling < 10; ++doubling, cell_m *= 2.0) {
    if (total >= soundings_per_column * static_cast<double>(columns.size())) break;
    CellIndex of_twice_the_size;
    for (const CellKey& key : columns.keys())
      of_twice_the_size.FindOrAdd({key.x >> 1, key.y >> 1, 0});
    columns = std::move(of_twice_the_size);
  }
  return cell_m;
}

}  // namespace seastitch
