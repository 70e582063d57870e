#include "mapper/loops/solution_judge.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "mapper/registration/height_grid.hpp"

namespace seastitch {
namespace {

using Cells = Grid<RegistrationSubmap::Cell>;

constexpr int kTileCells = 8;
// Uses every second row and column: neighbouring heights are smoothed over the same soundings.
constexpr int kEvery = 2;
// Smallest numbers of shared cells for a useful mean and mean square.
constexpr std::size_t kMinCellsOfPair = 8;
constexpr int kMinCellsOfTile = 4;
// Smallest number of shared cells of an overlap for which a solution can count as torn apart.
constexpr std::size_t kMinCellsTorn = 64;

struct Tile {
  int cells = 0;
  double dead_reckoned_m2 = 0.0;  // sums over the cells
  double solved_m2 = 0.0;
};

// Pose of submap b in submap a by the solution.
std::optional<Pose2> Relative(const PoseGraph& graph, SubmapId a, SubmapId b) {
  const auto find = [&](SubmapId id) -> const SolvedVertex* {
    const auto found = std::lower_bound(
        graph.vertices.begin(),
        graph.vertices.end(),
        id,
        [](const SolvedVertex& vertex, SubmapId wanted) { return vertex.id < wanted; });
    return found != graph.vertices.end() && found->id == id ? &*found : nullptr;
  };
  const SolvedVertex* const from = find(a);
  const SolvedVertex* const to = find(b);
  if (from == nullptr || to == nullptr) return std::nullopt;
  return Inverse(from->T_map_level) * to->T_map_level;
}

// Compares a pair cell by cell of the source. Differences: source minus target, with the
// dead-reckoned and with the solved poses.
class Comparison {
 public:
  Comparison(const Cells& target,
             const Cells& source,
             const Pose2& dead_reckoned,
             const Pose2& solved) {
    const GridGeometry& g = source.geometry();
    tile_cols_ = (g.cols + kTileCells - 1) / kTileCells;
    tile_rows_ = (g.rows + kTileCells - 1) / kTileCells;
    for (int row = 0; row < g.rows; row += kEvery) {
      for (int col = 0; col < g.cols; col += kEvery) {
        const RegistrationSubmap::Cell& cell = source(row, col);
        if (!(cell.variance > 0.0f)) continue;
        const Eigen::Vector2d p = g.Center(row, col);
        CellsAround around;
        HeightSample before;
        HeightSample after;
        const bool seen_before = Interpolate(target, dead_reckoned * p, &around, &before);
        const bool seen_after = Interpolate(target, solved * p, &around, &after);
        cells_dead_reckoned += seen_before ? 1 : 0;
        cells_solved += seen_after ? 1 : 0;
        if (!seen_before || !seen_after) continue;
        differences_.push_back({row / kTileCells * tile_cols_ + col / kTileCells,
                                {cell.height_m - before.height_m, cell.height_m - after.height_m}});
      }
    }
  }

  std::vector<Tile> Tiles() const {
    if (differences_.size() < kMinCellsOfPair) return {};
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Difference& d : differences_) mean += d.height_m;
    mean /= static_cast<double>(differences_.size());
    std::vector<Tile> tiles(static_cast<std::size_t>(tile_rows_ * tile_cols_));
    for (const Difference& d : differences_) {
      const Eigen::Vector2d squares = (d.height_m - mean).cwiseAbs2();
      Tile& tile = tiles[static_cast<std::size_t>(d.tile)];
      ++tile.cells;
      tile.dead_reckoned_m2 += squares.x();
      tile.solved_m2 += squares.y();
    }
    return tiles;
  }

  std::size_t cells_dead_reckoned = 0;  // cells seen by both submaps
  std::size_t cells_solved = 0;

 private:
  struct Difference {
    int tile;
    Eigen::Vector2d height_m;  // dead-reckoned, solved
  };
  int tile_rows_ = 0;
  int tile_cols_ = 0;
  std::vector<Difference> differences_;
};

}  // namespace

RegistrationSubmap SolutionJudge::Surface(const Submap& submap) {
  RegistrationParams params;
  params.num_levels = 1;
  params.max_cells = kMaxCells;
  return RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params);
}

void SolutionJudge::AddSubmap(const Submap& submap, RegistrationSubmap surface) {
  if (surface.empty()) return;
  views_[submap.id] = {LevelPose(submap.T_map_submap), std::move(surface)};
  if (views_.size() <= kMaxSubmaps) return;
  const SubmapId oldest = views_.begin()->first;
  views_.erase(views_.begin());
  std::erase_if(pairs_, [oldest](const auto& pair) { return pair.second == oldest; });
}

void SolutionJudge::AddPair(SubmapId target, SubmapId source) {
  if (views_.count(target) > 0 && views_.count(source) > 0) pairs_.insert({source, target});
}

Judgement SolutionJudge::Judge(const PoseGraph& graph) const {
  Judgement out;
  double gain = 0.0;  // squared differences of dead reckoning minus those of the solution
  double squared_gain = 0.0;
  double dead_reckoned_m2 = 0.0;
  double solved_m2 = 0.0;
  for (const auto& [source, target] : pairs_) {
    const std::optional<Pose2> solved = Relative(graph, target, source);
    if (!solved) continue;
    const View& target_view = views_.at(target);
    const View& source_view = views_.at(source);
    const Comparison pair(target_view.surface.levels().front().grid,
                          source_view.surface.levels().front().grid,
                          Inverse(target_view.T_map_level) * source_view.T_map_level,
                          *solved);
    out.cells_dead_reckoned += pair.cells_dead_reckoned;
    out.cells_solved += pair.cells_solved;
    for (const Tile& tile : pair.Tiles()) {
      if (tile.cells < kMinCellsOfTile) continue;
      const double d = (tile.solved_m2 - tile.dead_reckoned_m2) / tile.cells;
      gain += d;
      squared_gain += d * d;
      dead_reckoned_m2 += tile.dead_reckoned_m2 / tile.cells;
      solved_m2 += tile.solved_m2 / tile.cells;
      ++out.tiles;
    }
  }
  const bool worse =
      gain > kSigmas * std::sqrt(squared_gain) && solved_m2 > kTolerance * dead_reckoned_m2;
  out.torn = out.cells_dead_reckoned >= kMinCellsTorn &&
             static_cast<double>(out.cells_solved) <
                 kOverlapKept * static_cast<double>(out.cells_dead_reckoned);
  out.harmful = worse || out.torn;
  if (out.tiles > 0) {
    out.dead_reckoned_m = std::sqrt(dead_reckoned_m2 / out.tiles);
    out.solved_m = std::sqrt(solved_m2 / out.tiles);
  }
  return out;
}

}  // namespace seastitch
