#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <vector>

#include "mapper/submaps/cell_index.hpp"
#include "mapper/submaps/lane_median.hpp"

namespace seastitch {
namespace {

// With any share of numbers missing, also all of a lane, and with repeated ones.
template <std::size_t N>
void ExpectMediansOfSorting(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> part(0.0f, 1.0f);
  std::uniform_int_distribution<int> number(-6, 6);
  for (int trial = 0; trial < 500; ++trial) {
    std::array<Lanes, N> values;
    std::array<std::vector<float>, kLanes> sorted;
    const float missing = trial % 5 == 0 ? 0.0f : part(random);
    for (Lanes& value : values) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const bool is_missing = part(random) < missing || (lane == 3 && trial % 7 == 0);
        value[lane] = is_missing ? std::numeric_limits<float>::quiet_NaN()
                                 : 0.5f * static_cast<float>(number(random));
        if (!is_missing) sorted[static_cast<std::size_t>(lane)].push_back(value[lane]);
      }
    }
    const Lanes medians = UpperMedians(&values);
    for (int lane = 0; lane < kLanes; ++lane) {
      std::vector<float>& all = sorted[static_cast<std::size_t>(lane)];
      std::sort(all.begin(), all.end());
      EXPECT_EQ(medians[lane], all.empty() ? 0.0f : all[all.size() / 2]);
    }
  }
}

TEST(UpperMedians, AreThoseOfSorting) {
  ExpectMediansOfSorting<20>(1);
  ExpectMediansOfSorting<25>(2);
  ExpectMediansOfSorting<1>(3);
  ExpectMediansOfSorting<2>(4);
  ExpectMediansOfSorting<32>(5);
}

TEST(CellIndex, GivesATileWithItsBorder) {
  std::mt19937 random(6);
  std::uniform_int_distribution<int> place(-20, 20);
  CellIndex index;
  for (int i = 0; i < 400; ++i) index.FindOrAdd({place(random), place(random), 0});
  std::size_t cells = 0;
  for (std::size_t tile = 0; tile < index.tiles(); ++tile) {
    const CellIndex::Block block = index.BlockOf(tile);
    // The corner of the tile, by any cell in it.
    CellKey corner;
    for (std::size_t k = 0; k < block.size(); ++k) {
      const int x = static_cast<int>(k) / CellIndex::kBlockSide - CellIndex::kBorder;
      const int y = static_cast<int>(k) % CellIndex::kBlockSide - CellIndex::kBorder;
      const bool is_inside =
          x >= 0 && y >= 0 && x < CellIndex::kTileSide && y < CellIndex::kTileSide;
      if (!is_inside || block[k] == CellIndex::kNoCell) continue;
      const CellKey& key = index.keys()[block[k]];
      corner = {key.x - x, key.y - y, 0};
      ++cells;
    }
    for (std::size_t k = 0; k < block.size(); ++k) {
      const int x = static_cast<int>(k) / CellIndex::kBlockSide - CellIndex::kBorder;
      const int y = static_cast<int>(k) % CellIndex::kBlockSide - CellIndex::kBorder;
      const std::size_t found = index.Find({corner.x + x, corner.y + y, 0});
      EXPECT_EQ(block[k] == CellIndex::kNoCell ? CellIndex::kNone : block[k], found);
    }
  }
  EXPECT_EQ(cells, index.size());
}

}  // namespace
}  // namespace seastitch
