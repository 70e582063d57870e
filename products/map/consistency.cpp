#include "products/map/consistency.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <span>
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
    width_ = static_cast<std::size_t>(box_.col1 - box_.col0 + 1);
    start_.assign(width_ * static_cast<std::size_t>(box_.row1 - box_.row0 + 1) + 1, 0);
    for (const auto& [row, col] : cells) ++start_[Local(row, col) + 1];
    for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    points_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      points_[next[Local(cells[i].first, cells[i].second)]++] = points[i].p_ned;
    }
  }

  const CellBox& box() const { return box_; }
  std::size_t size() const { return points_.size(); }

  std::span<const Eigen::Vector3d> At(int row, int col) const {
    if (row < box_.row0 || row > box_.row1 || col < box_.col0 || col > box_.col1) return {};
    const std::size_t i = Local(row, col);
    return {points_.data() + start_[i], start_[i + 1] - start_[i]};
  }

 private:
  std::size_t Local(int row, int col) const {
    return static_cast<std::size_t>(row - box_.row0) * width_ +
           static_cast<std::size_t>(col - box_.col0);
  }

  CellBox box_;
  std::size_t width_ = 0;
  std::vector<std::uint32_t> start_;
  std::vector<Eigen::Vector3d> points_;
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

// Which of the four quadrants about a point hold another.
class Quadrants {
 public:
  void Add(double north, double east) {
    seen_ |= 1u << ((north >= 0.0 ? 1u : 0u) + (east >= 0.0 ? 2u : 0u));
  }
  bool all() const { return seen_ == 0b1111u; }

 private:
  unsigned seen_ = 0;
};

// Least-squares plane depth = a + b north + c east through points given relative to p.
class Plane {
 public:
  void Add(const Eigen::Vector3d& d) {
    count_ += 1.0;
    sum_ += d;
    sum_xx_ += d.x() * d.x();
    sum_xy_ += d.x() * d.y();
    sum_yy_ += d.y() * d.y();
    sum_zx_ += d.z() * d.x();
    sum_zy_ += d.z() * d.y();
    quadrants_.Add(d.x(), d.y());
  }
  // Distance of p itself from the plane, or nothing where the points do not hold a plane.
  std::optional<double> Distance() const {
    constexpr double kFewestPoints = 5.0;
    if (count_ < kFewestPoints || !quadrants_.all()) return std::nullopt;
    Eigen::Matrix3d normal;
    normal << count_, sum_.x(), sum_.y(), sum_.x(), sum_xx_, sum_xy_, sum_.y(), sum_xy_, sum_yy_;
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d plane = solver.solve(Eigen::Vector3d(sum_.z(), sum_zx_, sum_zy_));
    const double distance = std::abs(plane(0)) / std::sqrt(1.0 + plane.tail<2>().squaredNorm());
    if (!std::isfinite(distance)) return std::nullopt;
    return distance;
  }

 private:
  double count_ = 0.0;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  double sum_xx_ = 0.0, sum_xy_ = 0.0, sum_yy_ = 0.0, sum_zx_ = 0.0, sum_zy_ = 0.0;
  Quadrants quadrants_;
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
  for (const Eigen::Vector3d& p : from.At(row, col)) {
    double nearest = std::numeric_limits<double>::infinity();
    Quadrants quadrants;
    Plane plane;
    for (int r = row - 1; r <= row + 1; ++r) {
      for (int c = col - 1; c <= col + 1; ++c) {
        for (const Eigen::Vector3d& q : to.At(r, c)) {
          const Eigen::Vector3d d = q - p;
          nearest = std::min(nearest, d.squaredNorm());
          quadrants.Add(d.x(), d.y());
          if (d.head<2>().squaredNorm() <= cell_m * cell_m) plane.Add(d);
        }
      }
    }
    if (quadrants.all()) point.Add(std::sqrt(nearest));
    surface.Add(plane.Distance());
  }
  return {point.OrNoValue(), surface.OrNoValue()};
}

void AddPair(const CellCloud& a, const CellCloud& b, ConsistencyMap* map) {
  const double cell_m = map->submaps.geometry().cell_m;
  const CellBox shared = Intersection(a.box(), b.box());
  for (int row = shared.row0; row <= shared.row1; ++row) {
    for (int col = shared.col0; col <= shared.col1; ++col) {
      if (a.At(row, col).empty() || b.At(row, col).empty()) continue;
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
      if (!cloud.At(row, col).empty() && cell < std::numeric_limits<std::uint16_t>::max()) ++cell;
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
