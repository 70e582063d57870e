#include "mapper/submaps/footprint.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/linestring.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "common/core/grid.hpp"
#include "common/core/median.hpp"
#include "mapper/submaps/cell_index.hpp"

namespace seastitch {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point>;
using Mask = Grid<std::uint8_t>;

// Cells along the longer side: a resolution of 0.5 m for a swath of 50 m. An outline needs no more.
constexpr double kCellsAlong = 96.0;
constexpr double kSoundingsPerCell = 4.0;
// Free cells around the mask, so that closing it does not reach the border.
constexpr int kBorder = 3;

// Range of the points along one axis without a thousandth at each end, widened by 5 %: a single
// wild point must not coarsen the outline.
struct Extent {
  double low;
  double high;
};

Extent ExtentAlong(const std::vector<Eigen::Vector3f>& points, int axis) {
  std::vector<float> values;
  values.reserve(points.size());
  for (const Eigen::Vector3f& p : points) values.push_back(p[axis]);
  const std::size_t tail = values.size() / 1000;
  const auto [first, last] = OrderStatistics(tail, values.size() - 1 - tail, &values);
  const double low = first;
  const double high = last;
  const double margin = 0.05 * (high - low);
  return {low - margin, high + margin};
}

Mask OccupiedCells(const PointCloud& level) {
  const Extent x = ExtentAlong(level.points, 0);
  const Extent y = ExtentAlong(level.points, 1);
  const double size = std::max(x.high - x.low, y.high - y.low);
  if (!(size > 0.0)) return {};
  GridGeometry geometry;
  geometry.cell_m =
      CellForDensity(level.points, level.soundings, size / kCellsAlong, kSoundingsPerCell);
  const double border = kBorder * geometry.cell_m;
  geometry.origin = {x.low - border, y.low - border};
  geometry.rows = static_cast<int>((x.high - x.low) / geometry.cell_m) + 1 + 2 * kBorder;
  geometry.cols = static_cast<int>((y.high - y.low) / geometry.cell_m) + 1 + 2 * kBorder;
  Mask mask(geometry);
  for (const Eigen::Vector3f& p : level.points) {
    const Eigen::Vector2d xy = p.head<2>().cast<double>();
    if (xy.x() < x.low || xy.x() > x.high || xy.y() < y.low || xy.y() > y.high) continue;
    mask(geometry.Row(xy.x()), geometry.Col(xy.y())) = 1;
  }
  return mask;
}

// Dilation (grow: cells with any set cell among their 3 x 3) or erosion (cells whose 3 x 3 are all
// set).
Mask Morph(const Mask& mask, bool grow) {
  const GridGeometry& g = mask.geometry();
  Mask result(g);
  for (int r = 1; r + 1 < g.rows; ++r) {
    for (int c = 1; c + 1 < g.cols; ++c) {
      int set = 0;
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) set += mask(r + dr, c + dc);
      }
      result(r, c) = set >= (grow ? 1 : 9) ? 1 : 0;
    }
  }
  return result;
}

// The largest piece of cells connected by edges; of several the first by row.
Mask LargestPiece(const Mask& mask) {
  const GridGeometry& g = mask.geometry();
  Mask seen(g);
  std::vector<std::pair<int, int>> largest;
  for (int r0 = 0; r0 < g.rows; ++r0) {
    for (int c0 = 0; c0 < g.cols; ++c0) {
      if (mask(r0, c0) == 0 || seen(r0, c0) != 0) continue;
      std::vector<std::pair<int, int>> piece{{r0, c0}};
      seen(r0, c0) = 1;
      for (std::size_t i = 0; i < piece.size(); ++i) {
        const auto [r, c] = piece[i];
        for (const auto& [nr, nc] : {std::pair{r + 1, c}, {r - 1, c}, {r, c + 1}, {r, c - 1}}) {
          if (!g.Contains(nr, nc) || mask(nr, nc) == 0 || seen(nr, nc) != 0) continue;
          seen(nr, nc) = 1;
          piece.emplace_back(nr, nc);
        }
      }
      if (piece.size() > largest.size()) largest = std::move(piece);
    }
  }
  Mask result(g);
  for (const auto& [r, c] : largest) result(r, c) = 1;
  return result;
}

// Fills cells until no two cells touch by a corner only: there the outline would touch itself.
void FillTouchingCorners(Mask* mask) {
  const GridGeometry& g = mask->geometry();
  for (bool changed = true; changed;) {
    changed = false;
    for (int r = 0; r + 1 < g.rows; ++r) {
      for (int c = 0; c + 1 < g.cols; ++c) {
        const bool a = (*mask)(r, c) != 0;
        const bool b = (*mask)(r, c + 1) != 0;
        if (a == b || (*mask)(r + 1, c + 1) != (*mask)(r, c) ||
            (*mask)(r + 1, c) != (*mask)(r, c + 1))
          continue;
        (*mask)(r, c) = (*mask)(r, c + 1) = 1;
        changed = true;
      }
    }
  }
}

// Outline of the piece along the edges of its cells, with the piece on the right.
Polygon Outline(const Mask& mask) {
  const GridGeometry& g = mask.geometry();
  const auto set = [&](int r, int c) { return g.Contains(r, c) && mask(r, c) != 0; };
  Polygon polygon;
  int row = 0;
  int col = 0;
  while (row < g.rows && !set(row, col)) {
    if (++col == g.cols) {
      col = 0;
      ++row;
    }
  }
  if (row == g.rows) return polygon;
  // Steps along +col, +row, -col, -row. The first edge is the low-row edge of the first cell.
  constexpr int kStepRow[4] = {0, 1, 0, -1};
  constexpr int kStepCol[4] = {1, 0, -1, 0};
  const int first_row = row;
  const int first_col = col;
  int heading = 0;
  // Whether the cell ahead of corner (row, col) is set, on the inner or the outer side.
  const auto ahead = [&](bool inner) {
    constexpr int kInner[4][2] = {{0, 0}, {0, -1}, {-1, -1}, {-1, 0}};
    const int* offset = kInner[inner ? heading : (heading + 3) % 4];
    return set(row + offset[0], col + offset[1]);
  };
  do {
    bg::append(polygon.outer(),
               Point(g.origin.x() + g.cell_m * row, g.origin.y() + g.cell_m * col));
    do {
      row += kStepRow[heading];
      col += kStepCol[heading];
    } while (ahead(true) && !ahead(false));
    heading = ahead(true) ? (heading + 3) % 4 : (heading + 1) % 4;
  } while (row != first_row || col != first_col);
  bg::correct(polygon);
  return polygon;
}

Polygon WithFewCorners(const Polygon& outline, double cell_m) {
  // A closed polygon has its first corner twice.
  const auto usable = [](const Polygon& p) {
    return p.outer().size() >= 4 && p.outer().size() <= kMaxOutlineCorners + 1 && bg::is_valid(p);
  };
  // Tolerance: from one that straightens the stairs of a slanted edge to one that only a ragged
  // cloud needs.
  for (double tolerance = 0.75 * cell_m; tolerance < 20.0 * cell_m; tolerance *= 1.5) {
    Polygon simple;
    bg::simplify(outline, simple, tolerance);
    bg::correct(simple);
    if (usable(simple)) return simple;
  }
  Polygon hull;
  bg::convex_hull(outline, hull);
  Polygon simple;
  bg::simplify(hull, simple, cell_m);
  return usable(hull) ? hull : simple;
}

}  // namespace

Footprint FootprintOf(const PointCloud& level) {
  if (level.empty()) return {};
  const Mask occupied = OccupiedCells(level);
  if (occupied.cells().empty()) return {};
  // Closing by one cell removes the slits of dropped beams and pings.
  Mask piece = LargestPiece(Morph(Morph(occupied, true), false));
  FillTouchingCorners(&piece);
  const Polygon outline = WithFewCorners(Outline(piece), occupied.geometry().cell_m);
  Footprint footprint;
  const auto& ring = outline.outer();
  for (std::size_t i = 0; i + 1 < ring.size(); ++i)
    footprint.emplace_back(ring[i].x(), ring[i].y());
  return footprint;
}

double Area(const Footprint& footprint) {
  double twice = 0.0;
  for (std::size_t i = 0; i < footprint.size(); ++i) {
    const Eigen::Vector2d& a = footprint[i];
    const Eigen::Vector2d& b = footprint[(i + 1) % footprint.size()];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return 0.5 * std::abs(twice);
}

}  // namespace seastitch
