#include "products/map/consistency.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace seastitch {
namespace {

struct CellBox {
  int row0 = 0, col0 = 0, row1 = -1, col1 = -1;  // both ends inclusive
};

CellBox Intersection(const CellBox& a, const CellBox& b) {
  return {std::max(a.row0, b.row0),
          std::max(a.col0, b.col0),
          std::min(a.row1, b.row1),
          std::min(a.col1, b.col1)};
}

// Four numbers that are computed with beside each other, and masks of them (all bits of a lane set,
// or none).
using Float4 [[gnu::vector_size(16)]] = float;
using Int4 [[gnu::vector_size(16)]] = std::int32_t;
constexpr std::size_t kLanes = 4;

Float4 All(float value) { return Float4{value, value, value, value}; }
Float4 Where(Int4 mask, Float4 value) { return mask ? value : All(0.0f); }
double Sum(Float4 v) { return double{v[0]} + double{v[1]} + double{v[2]} + double{v[3]}; }

// Points in a row: their coordinates north, east, down from the cloud's origin [m].
struct PointRun {
  const float* north;
  const float* east;
  const float* down;
  std::size_t size;
};

// The points of one submap, sorted by map cell.
class CellCloud {
 public:
  CellCloud(const std::vector<MapPoint>& points, const GridGeometry& geometry) {
    std::vector<std::pair<int, int>> cells;
    cells.reserve(points.size());
    box_ = {std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), -1, -1};
    for (const MapPoint& point : points) {
      const int row = std::clamp(geometry.Row(point.north_east.x()), 0, geometry.rows - 1);
      const int col = std::clamp(geometry.Col(point.north_east.y()), 0, geometry.cols - 1);
      cells.emplace_back(row, col);
      box_ = {std::min(box_.row0, row),
              std::min(box_.col0, col),
              std::max(box_.row1, row),
              std::max(box_.col1, col)};
    }
    if (cells.empty()) return;
    origin_ = points.front().p_ned;
    width_ = static_cast<std::size_t>(box_.col1 - box_.col0 + 1);
    start_.assign(width_ * static_cast<std::size_t>(box_.row1 - box_.row0 + 1) + 1, 0);
    for (const auto& [row, col] : cells) ++start_[Local(row, col) + 1];
    for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::vector<float>* axis : {&north_, &east_, &down_}) axis->resize(points.size() + kLanes);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t k = next[Local(cells[i].first, cells[i].second)]++;
      const Eigen::Vector3f p = (points[i].p_ned - origin_).cast<float>();
      north_[k] = p.x();
      east_[k] = p.y();
      down_[k] = p.z();
    }
  }

  const CellBox& box() const { return box_; }
  std::size_t size() const { return start_.empty() ? 0 : start_.back(); }
  // Origin of the points' coordinates, north, east, down in the map frame [m]. It is one of them,
  // so that floats hold a submap of 100 m to 10 micrometres.
  const Eigen::Vector3d& origin() const { return origin_; }

  // The points of cells row, col_begin to row, col_end, both inclusive; kLanes numbers behind them
  // may be read.
  PointRun Run(int row, int col_begin, int col_end) const {
    const int first = std::max(col_begin, box_.col0), last = std::min(col_end, box_.col1);
    if (row < box_.row0 || row > box_.row1 || first > last) return {nullptr, nullptr, nullptr, 0};
    const std::size_t begin = start_[Local(row, first)], end = start_[Local(row, last) + 1];
    return {north_.data() + begin, east_.data() + begin, down_.data() + begin, end - begin};
  }
  bool IsEmpty(int row, int col) const { return Run(row, col, col).size == 0; }

 private:
  std::size_t Local(int row, int col) const {
    return static_cast<std::size_t>(row - box_.row0) * width_ +
           static_cast<std::size_t>(col - box_.col0);
  }

  CellBox box_;
  std::size_t width_ = 0;
  std::vector<std::uint32_t> start_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<float> north_, east_, down_;
};

// Cache of submaps: reads one when it is needed and drops the least recently used.
class CloudCache {
 public:
  using Load = std::function<std::shared_ptr<const CellCloud>(std::size_t)>;
  CloudCache(Load load, std::size_t max_points) : load_(std::move(load)), max_points_(max_points) {}

  std::shared_ptr<const CellCloud> Get(std::size_t i) {
    if (const auto it = held_.find(i); it != held_.end()) {
      used_.splice(used_.begin(), used_, it->second.second);
      return it->second.first;
    }
    std::shared_ptr<const CellCloud> cloud = load_(i);
    used_.push_front(i);
    held_.emplace(i, std::pair(cloud, used_.begin()));
    points_ += cloud->size();
    while (points_ > max_points_ && used_.size() > 1) {
      const auto oldest = held_.find(used_.back());
      points_ -= oldest->second.first->size();
      held_.erase(oldest);
      used_.pop_back();
    }
    return cloud;
  }

 private:
  Load load_;
  std::size_t max_points_;
  std::size_t points_ = 0;
  std::list<std::size_t> used_;  // newest first
  std::map<std::size_t,
           std::pair<std::shared_ptr<const CellCloud>, std::list<std::size_t>::iterator>>
      held_;
};

// What lies around a point: the nearest of the points added, and the least-squares plane
// depth = a + b north + c east through those within a radius of it horizontally.
class Around {
 public:
  // p: in the axes of the runs.
  Around(const Eigen::Vector3f& p, float radius_m)
      : north_(All(p.x())),
        east_(All(p.y())),
        down_(All(p.z())),
        radius2_(All(radius_m * radius_m)) {}

  void Add(const PointRun& run) {
    for (std::size_t i = 0; i < run.size; i += kLanes) {
      const auto left = static_cast<std::int32_t>(run.size - i);
      const Int4 is_there = Int4{0, 1, 2, 3} < Int4{left, left, left, left};
      const Float4 n = Load(run.north + i) - north_;
      const Float4 e = Load(run.east + i) - east_;
      const Float4 d = Load(run.down + i) - down_;
      const Float4 level2 = n * n + e * e;
      const Float4 distance2 = is_there ? level2 + d * d : All(kFar);
      nearest2_ = distance2 < nearest2_ ? distance2 : nearest2_;
      const Int4 is_north = n >= All(0.0f), is_east = e >= All(0.0f);
      // One bit for each of the four quadrants.
      const Int4 quadrant = (is_north & ((is_east & 8) | (~is_east & 4))) |
                            (~is_north & ((is_east & 2) | (~is_east & 1)));
      seen_ |= quadrant & is_there;
      const Int4 is_near = is_there & (level2 <= radius2_);
      seen_near_ |= quadrant & is_near;
      count_ += Where(is_near, All(1.0f));
      sum_n_ += Where(is_near, n);
      sum_e_ += Where(is_near, e);
      sum_d_ += Where(is_near, d);
      sum_nn_ += Where(is_near, n * n);
      sum_ne_ += Where(is_near, n * e);
      sum_ee_ += Where(is_near, e * e);
      sum_dn_ += Where(is_near, d * n);
      sum_de_ += Where(is_near, d * e);
    }
  }

  // Distance of the nearest point, or nothing where they are not on all sides.
  std::optional<double> DistanceOfNearest() const {
    if (!AreOnAllSides(seen_)) return std::nullopt;
    return std::sqrt(double{std::min({nearest2_[0], nearest2_[1], nearest2_[2], nearest2_[3]})});
  }
  // Distance of the plane, or nothing where the points do not hold one.
  std::optional<double> DistanceOfPlane() const {
    constexpr double kFewestPoints = 5.0;
    const double count = Sum(count_);
    if (count < kFewestPoints || !AreOnAllSides(seen_near_)) return std::nullopt;
    const double n = Sum(sum_n_) / count, e = Sum(sum_e_) / count, d = Sum(sum_d_) / count;
    const double nn = Sum(sum_nn_) / count - n * n, ee = Sum(sum_ee_) / count - e * e;
    const double ne = Sum(sum_ne_) / count - n * e;
    const double dn = Sum(sum_dn_) / count - d * n, de = Sum(sum_de_) / count - d * e;
    const double det = nn * ee - ne * ne;
    const double by_north = (dn * ee - de * ne) / det, by_east = (de * nn - dn * ne) / det;
    const double at_point = d - by_north * n - by_east * e;
    const double distance =
        std::abs(at_point) / std::sqrt(1.0 + by_north * by_north + by_east * by_east);
    if (!(det > 0.0) || !std::isfinite(distance)) return std::nullopt;
    return distance;
  }

 private:
  static constexpr float kFar = std::numeric_limits<float>::infinity();
  static Float4 Load(const float* values) {
    return Float4{values[0], values[1], values[2], values[3]};
  }
  static bool AreOnAllSides(Int4 seen) { return (seen[0] | seen[1] | seen[2] | seen[3]) == 0b1111; }

  const Float4 north_, east_, down_, radius2_;
  Float4 nearest2_ = All(kFar);
  Int4 seen_{}, seen_near_{};
  Float4 count_{}, sum_n_{}, sum_e_{}, sum_d_{};
  Float4 sum_nn_{}, sum_ne_{}, sum_ee_{}, sum_dn_{}, sum_de_{};
};

// Mean over what was added.
class Mean {
 public:
  void Add(const std::optional<double>& value) {
    if (!value) return;
    sum_ += *value;
    count_ += 1.0;
  }
  float OrNoValue() const { return count_ > 0.0 ? static_cast<float>(sum_ / count_) : kNoValue; }

 private:
  double sum_ = 0.0;
  double count_ = 0.0;
};

struct Errors {
  float point = kNoValue;
  float surface = kNoValue;
};

// e(c; from, to) by both measures.
Errors CellErrors(const CellCloud& from, int row, int col, const CellCloud& to, double cell_m) {
  Mean point, surface;
  const std::array<PointRun, 3> near{to.Run(row - 1, col - 1, col + 1),
                                     to.Run(row, col - 1, col + 1),
                                     to.Run(row + 1, col - 1, col + 1)};
  const Eigen::Vector3d shift = from.origin() - to.origin();
  const PointRun points = from.Run(row, col, col);
  for (std::size_t i = 0; i < points.size; ++i) {
    const Eigen::Vector3f p(points.north[i], points.east[i], points.down[i]);
    Around around((p.cast<double>() + shift).cast<float>(), static_cast<float>(cell_m));
    for (const PointRun& run : near) around.Add(run);
    point.Add(around.DistanceOfNearest());
    surface.Add(around.DistanceOfPlane());
  }
  return {point.OrNoValue(), surface.OrNoValue()};
}

void AddPair(const CellCloud& a, const CellCloud& b, ConsistencyMap* map) {
  const double cell_m = map->submaps.geometry().cell_m;
  const CellBox shared = Intersection(a.box(), b.box());
  for (int row = shared.row0; row <= shared.row1; ++row) {
    for (int col = shared.col0; col <= shared.col1; ++col) {
      if (a.IsEmpty(row, col) || b.IsEmpty(row, col)) continue;
      for (const Errors& e :
           {CellErrors(a, row, col, b, cell_m), CellErrors(b, row, col, a, cell_m)}) {
        float& point = map->point_error_m(row, col);
        float& surface = map->surface_error_m(row, col);
        point = std::max(point, e.point);
        surface = std::max(surface, e.surface);
      }
    }
  }
}

void CountSeen(const CellCloud& cloud, Grid<std::uint16_t>* seen) {
  const CellBox& box = cloud.box();
  for (int row = box.row0; row <= box.row1; ++row) {
    for (int col = box.col0; col <= box.col1; ++col) {
      std::uint16_t& cell = (*seen)(row, col);
      if (!cloud.IsEmpty(row, col) && cell < std::numeric_limits<std::uint16_t>::max()) ++cell;
    }
  }
}

ErrorFigures FiguresOf(std::vector<float> errors) {
  ErrorFigures f;
  f.cells = errors.size();
  if (errors.empty()) {
    f.rms_m = f.median_m = f.p95_m = std::numeric_limits<double>::quiet_NaN();
    return f;
  }
  double squares = 0.0;
  for (const float e : errors) squares += static_cast<double>(e) * static_cast<double>(e);
  f.rms_m = std::sqrt(squares / static_cast<double>(errors.size()));
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&](double q) {
    const double rank = q * static_cast<double>(errors.size() - 1);
    return static_cast<double>(errors[static_cast<std::size_t>(std::lround(rank))]);
  };
  f.median_m = quantile(0.5);
  f.p95_m = quantile(0.95);
  return f;
}

std::vector<float> WhereAlike(const ConsistencyMap& map,
                              const ConsistencyMap& other,
                              Grid<float> ConsistencyMap::*measure) {
  const std::vector<float>& mine = (map.*measure).cells();
  const std::vector<float>& theirs = (other.*measure).cells();
  std::vector<float> errors;
  for (std::size_t i = 0; i < mine.size(); ++i) {
    const bool as_many = map.submaps.cells()[i] == other.submaps.cells()[i];
    if (as_many && mine[i] != kNoValue && theirs[i] != kNoValue) errors.push_back(mine[i]);
  }
  return errors;
}

}  // namespace

ConsistencyMap ComputeConsistency(const std::vector<SurveySubmap>& submaps,
                                  const SurveyPoses& poses,
                                  const MapProjection& projection,
                                  const GridGeometry& geometry,
                                  std::size_t cache_points,
                                  const std::function<void(std::size_t)>& on_submap) {
  ConsistencyMap map{Grid<float>(geometry, kNoValue),
                     Grid<float>(geometry, kNoValue),
                     Grid<std::uint16_t>(geometry, 0)};
  std::vector<Eigen::AlignedBox2d> boxes;
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    boxes.push_back(NorthEastBox(submaps, poses, i, projection));
  }
  CloudCache clouds(
      [&](std::size_t i) {
        return std::make_shared<const CellCloud>(LoadMapPoints(submaps, poses, i, projection),
                                                 geometry);
      },
      cache_points);
  for (std::size_t m = 0; m < submaps.size(); ++m) {
    if (on_submap) on_submap(m);
    if (boxes[m].isEmpty()) continue;
    // Boxes are wider by a cell, since two points of one cell may lie that far apart.
    Eigen::AlignedBox2d reach = boxes[m];
    reach.min().array() -= geometry.cell_m;
    reach.max().array() += geometry.cell_m;
    const std::shared_ptr<const CellCloud> cloud = clouds.Get(m);
    CountSeen(*cloud, &map.submaps);
    for (std::size_t n = m + 1; n < submaps.size(); ++n) {
      if (!boxes[n].isEmpty() && reach.intersects(boxes[n])) {
        AddPair(*cloud, *clouds.Get(n), &map);
      }
    }
  }
  return map;
}

Raster Mismatch(const ConsistencyMap& map) {
  Raster raster;
  raster.description = "swath mismatch: surface error between submaps";
  raster.unit = "m";
  raster.values = map.surface_error_m.cells();
  std::replace(raster.values.begin(), raster.values.end(), kNoValue, kNoData);
  return raster;
}

ConsistencyFigures Figures(const ConsistencyMap& map) { return FiguresOfComparableCells(map, map); }

ConsistencyFigures FiguresOfComparableCells(const ConsistencyMap& map,
                                            const ConsistencyMap& other) {
  return {FiguresOf(WhereAlike(map, other, &ConsistencyMap::point_error_m)),
          FiguresOf(WhereAlike(map, other, &ConsistencyMap::surface_error_m))};
}

}  // namespace seastitch
