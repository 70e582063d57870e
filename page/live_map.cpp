#include "page/live_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

constexpr float kNone = -1e6f;
constexpr double kMostPixels = 400'000.0;
// Cells of the picture a side of a submap's cell: the grids of submaps are turned against it.
constexpr double kPixelCells = 1.25;
// Part of a submap's cell that a cell of the picture has at least: with less it is a rim.
constexpr double kLeastWeight = 0.25;
constexpr double kFarthestM = 1e6;  // from the map origin

std::int32_t CellOf(double x, double cell_m) {
  return static_cast<std::int32_t>(std::floor(std::clamp(x, -kFarthestM, kFarthestM) / cell_m));
}

// Moves a point of the map as a submap's frame was moved.
Eigen::Vector2d Moved(const Eigen::Vector2d& p, const Pose2& from, const Pose2& to) {
  return to * (Inverse(from) * p);
}

double AreaOf(const Footprint& outline) {
  double twice = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2.0;
}

// Joins the cells with the same place.
template <class Cell>
void Join(std::vector<Cell>* cells) {
  std::sort(cells->begin(), cells->end(), [](const Cell& a, const Cell& b) {
    return std::tie(a.row, a.col) < std::tie(b.row, b.col);
  });
  std::vector<Cell> joined;
  for (const Cell& cell : *cells) {
    if (joined.empty() || joined.back().row != cell.row || joined.back().col != cell.col) {
      joined.push_back(cell);
      continue;
    }
    Cell& sum = joined.back();
    const float weight = sum.weight + cell.weight;
    sum.depth_m += (cell.depth_m - sum.depth_m) * cell.weight / weight;
    sum.weight = weight;
  }
  *cells = std::move(joined);
}

}  // namespace

LiveMap::LiveMap(double cell_m, std::size_t most_cells)
    : finest_m_(cell_m), cell_m_(cell_m), most_cells_(most_cells) {}

void LiveMap::Clear() {
  pieces_.clear();
  solution_.reset();
  solved_.clear();
  track_.clear();
  track_every_ = 1;
  cells_ = 0;
  cell_m_ = finest_m_;
}

// The median: one odd submap makes no cells coarse.
double LiveMap::TypicalSpacing() const {
  std::vector<double> apart_m;
  for (const auto& [id, piece] : pieces_) apart_m.push_back(piece.apart_m);
  return Median(std::move(apart_m));
}

bool LiveMap::Add(const Submap& submap) {
  if (!HasSoundings(submap.trigger)) return false;
  const auto held = pieces_.find(submap.id);
  const bool is_held = held != pieces_.end();
  if (is_held && held->second.frame_time == submap.frame_time) return false;
  if (is_held) Clear();
  const double points = std::max(1.0, static_cast<double>(submap.cloud.size()));
  const double apart_m = std::min(kFarthestM, std::sqrt(AreaOf(submap.footprint) / points));
  Piece piece{submap.frame_time, LevelPose(submap.T_map_submap), submap.footprint, apart_m, {}};
  const Eigen::Matrix3d R = LevelFromBody(submap.T_map_submap);
  const double z = submap.T_map_submap.translation().z();
  piece.cells.reserve(submap.cloud.size());
  for (std::size_t i = 0; i < submap.cloud.size(); ++i) {
    const Eigen::Vector3d p = R * submap.cloud.points[i].cast<double>();
    piece.cells.push_back({CellOf(p.x(), cell_m_),
                           CellOf(p.y(), cell_m_),
                           static_cast<float>(z + p.z()),
                           std::max(1.0f, submap.cloud.soundings[i])});
  }
  Join(&piece.cells);
  cells_ += piece.cells.size();
  pieces_.emplace(submap.id, std::move(piece));
  // Cells at least as large as the points are apart, so that the map has no holes.
  const double spacing_m = TypicalSpacing();
  while (cell_m_ < spacing_m || (cells_ > most_cells_ && cells_ > pieces_.size())) Coarsen();
  ++version_;
  return is_held;
}

void LiveMap::Coarsen() {
  cell_m_ *= 2.0;
  cells_ = 0;
  for (auto& [id, piece] : pieces_) {
    for (Cell& cell : piece.cells) {
      cell.row >>= 1;
      cell.col >>= 1;
    }
    Join(&piece.cells);
    piece.cells.shrink_to_fit();
    cells_ += piece.cells.size();
  }
}

void LiveMap::Add(const PoseGraph& solution) {
  solution_ = solution;
  solved_.clear();
  for (const SolvedVertex& vertex : solution.vertices) solved_[vertex.id] = vertex.T_map_level;
  ++version_;
}

void LiveMap::AddTrack(Time time, const Eigen::Vector2d& north_east) {
  if (++track_skipped_ < track_every_) return;
  track_skipped_ = 0;
  track_.push_back({time, north_east});
  if (track_.size() <= kMostTrackPoints) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < track_.size(); i += 2) track_[kept++] = track_[i];
  track_.resize(kept);
  track_every_ *= 2;
}

std::size_t LiveMap::closures(bool used) const {
  if (!solution_) return 0;
  return static_cast<std::size_t>(std::count_if(
      solution_->loop_edges.begin(), solution_->loop_edges.end(), [used](const SolvedEdge& edge) {
        return (edge.weight >= kAcceptedWeight) == used;
      }));
}

Pose2 LiveMap::PoseOf(SubmapId id, const Piece& piece, Poses poses) const {
  if (poses == Poses::kDeadReckoned) return piece.dead_reckoned;
  if (const auto found = solved_.find(id); found != solved_.end()) return found->second;
  // One that is not solved yet follows the newest solved one before it.
  for (auto before = pieces_.lower_bound(id); before != pieces_.begin();) {
    --before;
    if (const auto found = solved_.find(before->first); found != solved_.end())
      return found->second * (Inverse(before->second.dead_reckoned) * piece.dead_reckoned);
  }
  return piece.dead_reckoned;
}

std::optional<GridGeometry> LiveMap::Geometry() const {
  Eigen::Vector2d least = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d most = -least;
  for (const auto& [id, piece] : pieces_) {
    if (piece.cells.empty()) continue;
    Eigen::Vector2d low = least, high = most;
    for (const Poses poses : {Poses::kDeadReckoned, Poses::kSolved}) {
      const Pose2 T_map_level = PoseOf(id, piece, poses);
      for (const Cell& cell : piece.cells) {
        const Eigen::Vector2d at = T_map_level * Middle(cell);
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
      }
    }
    if (low.cwiseAbs().maxCoeff() > kFarthestM || high.cwiseAbs().maxCoeff() > kFarthestM) continue;
    least = low;
    most = high;
  }
  if (!(least.x() <= most.x())) return std::nullopt;
  const Eigen::Vector2d size = most - least + Eigen::Vector2d::Constant(4.0 * cell_m_);
  double pixel_m = std::max(kPixelCells * cell_m_, std::sqrt(size.prod() / kMostPixels));
  // A long and narrow map has more cells for the last row and column.
  pixel_m = std::max(pixel_m, size.maxCoeff() / (0.1 * kMostPixels));
  const Eigen::Vector2d rim = Eigen::Vector2d::Constant(pixel_m);
  return GridGeometry::Covering(least - rim, most + rim, pixel_m);
}

std::vector<float> LiveMap::Elevations(const GridGeometry& geometry, Poses poses) const {
  std::vector<double> sums(geometry.size(), 0.0), weights(geometry.size(), 0.0);
  for (const auto& [id, piece] : pieces_) {
    const Pose2 T_map_level = PoseOf(id, piece, poses);
    for (const Cell& cell : piece.cells) {
      // Shared between the four nearest cells of the picture.
      const Eigen::Vector2d p = (T_map_level * Middle(cell) - geometry.origin) / geometry.cell_m -
                                Eigen::Vector2d::Constant(0.5);
      const double row = std::floor(p.x()), col = std::floor(p.y());
      if (std::abs(row) > kFarthestM || std::abs(col) > kFarthestM) continue;
      for (const int down : {0, 1})
        for (const int right : {0, 1}) {
          const int r = static_cast<int>(row) + down, c = static_cast<int>(col) + right;
          if (!geometry.Contains(r, c)) continue;
          const double share = (down == 1 ? p.x() - row : 1.0 - p.x() + row) *
                               (right == 1 ? p.y() - col : 1.0 - p.y() + col);
          const std::size_t at = geometry.Index(r, c);
          sums[at] += share * cell.depth_m;
          weights[at] += share;
        }
    }
  }
  std::vector<float> elevations(geometry.size(), kNone);
  for (std::size_t i = 0; i < elevations.size(); ++i)
    if (weights[i] >= kLeastWeight) elevations[i] = static_cast<float>(-sums[i] / weights[i]);
  return elevations;
}

// Each point moves with the frames before and after it, in proportion to the time between them.
MapLines::Line LiveMap::CorrectedTrack() const {
  struct Frame {
    Time time;
    Pose2 from, to;
  };
  std::vector<Frame> frames;
  for (const auto& [id, piece] : pieces_)
    if (const auto found = solved_.find(id); found != solved_.end())
      frames.push_back({piece.frame_time, piece.dead_reckoned, found->second});
  MapLines::Line line;
  for (const TrackPoint& point : track_) {
    if (frames.empty()) {
      line.push_back(point.north_east);
      continue;
    }
    const auto after = FirstAfter(frames, point.time);
    const Frame& next = after == frames.end() ? frames.back() : *after;
    const Frame& last = after == frames.begin() ? frames.front() : *(after - 1);
    const double span_s = ToSeconds(next.time - last.time);
    const double share = span_s > 0.0 ? ToSeconds(point.time - last.time) / span_s : 0.0;
    line.push_back((1.0 - share) * Moved(point.north_east, last.from, last.to) +
                   share * Moved(point.north_east, next.from, next.to));
  }
  return line;
}

MapLines LiveMap::Lines() const {
  MapLines lines;
  MapLines::Line navigated;
  for (const TrackPoint& point : track_) navigated.push_back(point.north_east);
  lines.track = {CorrectedTrack()};
  if (solution_) lines.track_as_navigated = {std::move(navigated)};
  for (const auto& [id, piece] : pieces_) {
    MapLines::Submap submap{id.value, {}};
    for (const Eigen::Vector2d& corner : piece.outline)
      submap.outline.push_back(PoseOf(id, piece, Poses::kSolved) * corner);
    if (submap.outline.size() >= 3) lines.submaps.push_back(std::move(submap));
  }
  if (!solution_) return lines;
  for (const SolvedEdge& edge : solution_->loop_edges) {
    const auto from = solved_.find(edge.from), to = solved_.find(edge.to);
    if (from == solved_.end() || to == solved_.end()) continue;
    lines.closures.push_back(
        {{from->second.Translation(), to->second.Translation()}, edge.weight >= kAcceptedWeight});
  }
  return lines;
}

std::optional<std::string> LiveMap::Json() const {
  const auto geometry = Geometry();
  if (!geometry) return std::nullopt;
  MapData data(*geometry);
  if (solution_) data.Add("elevation_before", Elevations(*geometry, Poses::kDeadReckoned), kNone);
  data.Add("elevation", Elevations(*geometry, Poses::kSolved), kNone);
  return data.Json(Lines());
}

}  // namespace seastitch
