#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "common/core/median.hpp"
#include "mapper/registration/local_noise.hpp"
#include "mapper/registration/registration.hpp"
#include "mapper/registration/smoothing.hpp"

namespace seastitch {
namespace {

// Sums over the soundings of a cell. x and y are relative to the middle of the cloud, z to its
// mean.
enum Moment { kN, kX, kY, kXX, kXY, kYY, kZ, kXZ, kYZ, kZZ, kPoints, kUnused, kNumMoments };
using CellSums = Eigen::Array<double, kNumMoments, 1>;

// Fewest points under a kernel with peak 1. They weigh as much as twice as many points of equal
// weight. With fewer no plane is fitted.
constexpr double kMinPoints = 2.0;
// Smallest spread of the soundings under a kernel in any direction, in cells. Evenly spread
// soundings have 1.
constexpr double kMinSpreadCells = 0.4;
// Largest distance between the mean position of these soundings and the cell's centre, in cells:
// 0.8 on a straight rim of evenly spread soundings, 1.1 in a corner. Beyond it the plane would be
// extrapolated.
constexpr double kMaxLeverCells = 1.0;

// A point in the level frame; float is as exact here as in the cloud.
struct LevelPoint {
  Eigen::Vector3f p;
  float n;
};

std::vector<LevelPoint> UsableSoundings(const PointCloud& cloud, const Eigen::Matrix3d& R) {
  std::vector<LevelPoint> out;
  if (!R.allFinite()) return out;
  const std::size_t size = std::min(cloud.points.size(), cloud.soundings.size());
  out.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    const float n = cloud.soundings[i];
    // Excludes values that are not finite, and values that cannot be soundings: the square of 1e9 m
    // would swamp all others.
    if (!((p.array().abs() < 1e6f).all() && n > 0.0f && n < 1e9f)) continue;
    out.push_back({(R * p.cast<double>()).cast<float>(), n});
  }
  return out;
}

struct Box {
  Eigen::Vector2d min;
  Eigen::Vector2d max;
  Eigen::Vector2d Size() const { return max - min; }
  bool Contains(const LevelPoint& s) const {
    return s.p.x() >= min.x() && s.p.x() <= max.x() && s.p.y() >= min.y() && s.p.y() <= max.y();
  }
};

Box BoundingBox(const std::vector<LevelPoint>& soundings) {
  Eigen::Vector2f min = soundings.front().p.head<2>();
  Eigen::Vector2f max = min;
  for (const LevelPoint& s : soundings) {
    min = min.cwiseMin(s.p.head<2>());
    max = max.cwiseMax(s.p.head<2>());
  }
  return {min.cast<double>(), max.cast<double>()};
}

// Box without the outermost 0.5 % of the soundings on every side, widened by 20 % of its size on
// every side.
Box CoreBox(const std::vector<LevelPoint>& soundings) {
  Box box;
  std::vector<double> values(soundings.size());
  const std::size_t cut = soundings.size() / 200;
  for (int axis = 0; axis < 2; ++axis) {
    std::transform(soundings.begin(), soundings.end(), values.begin(), [&](const LevelPoint& s) {
      return s.p[axis];
    });
    std::tie(box.min[axis], box.max[axis]) = OrderStatistics(cut, values.size() - 1 - cut, &values);
  }
  const Eigen::Vector2d margin = 0.2 * box.Size();
  box.min -= margin;
  box.max += margin;
  return box;
}

double CellsOf(const Box& box, double cell_m) {
  return (box.Size().x() / cell_m + 2.0) * (box.Size().y() / cell_m + 2.0);
}

// GridGeometry::Row and Col for positions inside the grid.
int RowInside(const GridGeometry& g, const LevelPoint& s) {
  return static_cast<int>((s.p.x() - g.origin.x()) / g.cell_m);
}
int ColInside(const GridGeometry& g, const LevelPoint& s) {
  return static_cast<int>((s.p.y() - g.origin.y()) / g.cell_m);
}

// Mean distance of neighbouring points, all inside the box: from the total area of the occupied
// cells of a trial grid.
double PointSpacing(const std::vector<LevelPoint>& soundings, const Box& box) {
  const double count = static_cast<double>(soundings.size());
  const Eigen::Vector2d size = box.Size();
  const double trial_cell =
      std::max({3.0 * std::sqrt(size.x() * size.y() / count), size.maxCoeff() / 2000.0, 1e-3});
  const GridGeometry g = GridGeometry::Covering(box.min, box.max, trial_cell);
  std::vector<char> occupied(g.size(), 0);
  for (const LevelPoint& s : soundings) occupied[g.Index(RowInside(g, s), ColInside(g, s))] = 1;
  const auto cells = std::count(occupied.begin(), occupied.end(), 1);
  return trial_cell * std::sqrt(static_cast<double>(cells) / count);
}

// The finest level with cells of at least this size.
int LevelAtLeast(double cell_m) { return static_cast<int>(std::ceil(std::log2(cell_m) - 1e-9)); }
double CellEdge(int level) { return std::exp2(level); }

// Soundings sorted by rows of a grid, so that they are read row by row.
struct SoundingRows {
  std::vector<LevelPoint> soundings;
  std::vector<std::size_t> ends;  // end of every row
};

SoundingRows SortIntoRows(const std::vector<LevelPoint>& soundings, const GridGeometry& g) {
  SoundingRows out;
  const auto row_of = [&](const LevelPoint& s) {
    return static_cast<std::size_t>(RowInside(g, s));
  };
  out.ends.assign(static_cast<std::size_t>(g.rows), 0);
  for (const LevelPoint& s : soundings) ++out.ends[row_of(s)];
  std::size_t start = 0;
  for (std::size_t& end : out.ends) start += std::exchange(end, start);
  out.soundings.resize(soundings.size());
  for (const LevelPoint& s : soundings) out.soundings[out.ends[row_of(s)]++] = s;
  return out;
}

// Sums of every cell of a level. x and y are relative to `middle`.
struct RawLevel {
  GridGeometry geometry;
  Eigen::Vector2d middle;
  std::vector<CellSums> cells;
  std::vector<ColumnSpan> columns;  // range of occupied cells of every row

  CellSums* Row(int row) { return cells.data() + geometry.Index(row, 0); }

  // An empty level with cells of twice the size. Corners are at multiples of the cell size, so
  // pairs of cells may begin at an even or an odd cell.
  RawLevel Coarser() const {
    const GridGeometry& g = geometry;
    RawLevel out;
    out.middle = middle;
    out.geometry =
        GridGeometry::Covering(g.Center(0, 0), g.Center(g.rows - 1, g.cols - 1), 2.0 * g.cell_m);
    out.cells.assign(out.geometry.size(), CellSums::Zero());
    out.columns.resize(static_cast<std::size_t>(out.geometry.rows));
    return out;
  }

  // Adds a row of the level with cells of half the size.
  void AddFiner(const GridGeometry& fine, int fine_row, ColumnSpan span, const CellSums* line) {
    if (span.empty()) return;
    const int odd_row = geometry.Row(fine.Center(1, 0).x());
    const int odd_col = geometry.Col(fine.Center(0, 1).y());
    const int row = (fine_row + odd_row) / 2;
    CellSums* out = Row(row);
    for (int col = span.first; col < span.last; ++col) out[(col + odd_col) / 2] += line[col];
    ColumnSpan& filled = columns[static_cast<std::size_t>(row)];
    filled = filled.Union({(span.first + odd_col) / 2, (span.last - 1 + odd_col) / 2 + 1});
  }
};

void AddSounding(double n, double x, double y, double z, CellSums* sums) {
  CellSums& m = *sums;
  m[kN] += n;
  m[kX] += n * x;
  m[kY] += n * y;
  m[kXX] += n * (x * x);
  m[kXY] += n * (x * y);
  m[kYY] += n * (y * y);
  m[kZ] += n * z;
  m[kXZ] += n * (x * z);
  m[kYZ] += n * (y * z);
  m[kZZ] += n * (z * z);
  m[kPoints] += 1.0;
}

// Sums the soundings in one row of the finest level.
ColumnSpan Bin(const SoundingRows& sorted,
               const GridGeometry& g,
               const Eigen::Vector2d& middle,
               double datum,
               int row,
               CellSums* line) {
  const auto r = static_cast<std::size_t>(row);
  ColumnSpan columns;
  for (std::size_t i = r == 0 ? 0 : sorted.ends[r - 1]; i < sorted.ends[r]; ++i) {
    const LevelPoint& s = sorted.soundings[i];
    const int col = ColInside(g, s);
    AddSounding(s.n, s.p.x() - middle.x(), s.p.y() - middle.y(), s.p.z() - datum, &line[col]);
    columns = columns.Union({col, col + 1});
  }
  return columns;
}

// Factor of the covariance of height and slope, relative to equal weights. Errors are weighted by
// the square of the kernel, whose mean position at a rim is nearer to the rim. Fitted to integrals
// over a half-plane of evenly spread soundings, to 3 %; lever_cells: distance of their mean
// position from the cell's centre.
double RimFactor(double lever_cells) {
  return 1.5 - 0.52 * lever_cells - 0.22 * lever_cells * lever_cells;
}

// Fits a plane under a kernel by weighted least squares: height and slope at p. The cell remains
// unchanged if the soundings are too few or on one side.
void FitPlane(const CellSums& m,
              const Eigen::Vector2d& p,
              double cell_m,
              double peak,
              RegistrationSubmap::Cell* out) {
  // kPoints counts points under a kernel with sum 1. Divided by its peak: under a kernel with peak
  // 1.
  if (!(m[kPoints] >= kMinPoints * peak)) return;
  const double inverse_n = 1.0 / m[kN];
  const CellSums mean = m * inverse_n;
  const double xx = mean[kXX] - mean[kX] * mean[kX];
  const double xy = mean[kXY] - mean[kX] * mean[kY];
  const double yy = mean[kYY] - mean[kY] * mean[kY];
  // The smaller eigenvalue of the spread must be at least this.
  const double least = (kMinSpreadCells * cell_m) * (kMinSpreadCells * cell_m);
  if (!(xx >= least && (xx - least) * (yy - least) >= xy * xy)) return;
  const double lever_x = p.x() - mean[kX];
  const double lever_y = p.y() - mean[kY];
  const double lever_cells = std::sqrt(lever_x * lever_x + lever_y * lever_y) / cell_m;
  if (lever_cells > kMaxLeverCells) return;
  const double inverse_determinant = 1.0 / (xx * yy - xy * xy);
  const double xz = mean[kXZ] - mean[kX] * mean[kZ];
  const double yz = mean[kYZ] - mean[kY] * mean[kZ];
  const double slope_x = inverse_determinant * (yy * xz - xy * yz);
  const double slope_y = inverse_determinant * (xx * yz - xy * xz);
  // Covariance of height and slope, relative to the variance of a mean of as many soundings, for
  // equal weights.
  const double with_slope_x = inverse_determinant * (yy * lever_x - xy * lever_y);
  const double with_slope_y = inverse_determinant * (xx * lever_y - xy * lever_x);
  // The fit removes one point's worth from the residual. For a Gaussian kernel K, K^2 has half the
  // area and half the spread of K, and 1/2 + 1/4 + 1/4 = 1.
  const double residual = mean[kZZ] - mean[kZ] * mean[kZ] - slope_x * xz - slope_y * yz;
  const double scatter = std::max(0.0, residual) * m[kN] / (m[kPoints] - peak);
  out->height_m = static_cast<float>(mean[kZ] + slope_x * lever_x + slope_y * lever_y);
  out->slope_x = static_cast<float>(slope_x);
  out->slope_y = static_cast<float>(slope_y);
  out->variance =
      static_cast<float>(inverse_n * (1.0 + with_slope_x * lever_x + with_slope_y * lever_y));
  const double by_weight = RimFactor(lever_cells);
  out->covariance_x = static_cast<float>(by_weight * inverse_n * with_slope_x);
  out->covariance_y = static_cast<float>(by_weight * inverse_n * with_slope_y);
  out->scatter = static_cast<float>(scatter);
}

// Fits a plane in every cell of a level. load: see SmoothRows.
template <class Load>
RegistrationSubmap::Level FitLevel(int number,
                                   const GridGeometry& g,
                                   const Eigen::Vector2d& middle,
                                   Load load) {
  const double peak = SmoothingKernel().Peak();
  RegistrationSubmap::Level level{number, Grid<RegistrationSubmap::Cell>(g)};
  const auto load_and_count = [&](int row, CellSums* line) {
    const ColumnSpan columns = load(row, line);
    for (int col = columns.first; col < columns.last; ++col)
      level.grid(row, col).soundings = static_cast<float>(line[col][kN]);
    return columns;
  };
  SmoothRows<CellSums>(
      g.rows, g.cols, load_and_count, [&](int row, ColumnSpan columns, const CellSums* line) {
        for (int col = columns.first; col < columns.last; ++col) {
          const Eigen::Vector2d p = g.Center(row, col) - middle;
          FitPlane(line[col], p, g.cell_m, peak, &level.grid(row, col));
        }
      });
  return level;
}

// Median of the scatter of the known cells; nothing if there are none.
std::optional<float> MedianScatter(const RegistrationSubmap::Level& level) {
  std::vector<float> scatters;
  scatters.reserve(level.grid.cells().size());
  for (const RegistrationSubmap::Cell& cell : level.grid.cells())
    if (cell.variance > 0.0f) scatters.push_back(cell.scatter);
  if (scatters.empty()) return std::nullopt;
  return Median(std::move(scatters));
}

}  // namespace

RegistrationSubmap RegistrationSubmap::Prepare(const PointCloud& cloud,
                                               const Eigen::Matrix3d& R_level_submap,
                                               const RegistrationParams& params) {
  RegistrationSubmap out;
  std::vector<LevelPoint> soundings = UsableSoundings(cloud, R_level_submap);
  if (soundings.size() < 16) return out;
  const auto max_cells = static_cast<double>(params.max_cells);
  const auto count = static_cast<double>(soundings.size());
  Box box = BoundingBox(soundings);
  // More than ten cells per point: most cells are empty, because some points are far from all
  // others.
  double spacing = PointSpacing(soundings, box);
  if (CellsOf(box, std::max(spacing, params.min_cell_m)) > std::min(max_cells, 10.0 * count)) {
    box = CoreBox(soundings);
    std::erase_if(soundings, [&](const LevelPoint& s) { return !box.Contains(s); });
    spacing = PointSpacing(soundings, box);
  }
  int finest = LevelAtLeast(std::max(params.cell_per_spacing * spacing, params.min_cell_m));
  while (CellsOf(box, CellEdge(finest)) > max_cells) ++finest;

  double sum_z = 0.0;
  double sum_n = 0.0;
  for (const LevelPoint& s : soundings) {
    sum_z += static_cast<double>(s.n) * s.p.z();
    sum_n += s.n;
  }
  out.height_datum_m_ = sum_z / sum_n;

  // The finest level is summed row by row. While a level is fitted, its rows are added to the next
  // coarser level.
  const GridGeometry finest_grid = GridGeometry::Covering(box.min, box.max, CellEdge(finest));
  const Eigen::Vector2d middle = 0.5 * (box.min + box.max);
  const SoundingRows sorted = SortIntoRows(soundings, finest_grid);
  RawLevel next = RawLevel{finest_grid, middle, {}, {}}.Coarser();
  out.levels_.push_back(FitLevel(finest, finest_grid, middle, [&](int row, CellSums* line) {
    const ColumnSpan columns = Bin(sorted, finest_grid, middle, out.height_datum_m_, row, line);
    next.AddFiner(finest_grid, row, columns, line);
    return columns;
  }));
  for (int i = 1; i < params.num_levels; ++i) {
    RawLevel raw = std::exchange(next, next.Coarser());
    out.levels_.push_back(FitLevel(finest + i, raw.geometry, middle, [&](int row, CellSums* line) {
      const ColumnSpan columns = raw.columns[static_cast<std::size_t>(row)];
      std::copy(raw.Row(row) + columns.first, raw.Row(row) + columns.last, line + columns.first);
      next.AddFiner(raw.geometry, row, columns, line);
      return columns;
    }));
  }
  const LocalNoise noise(out.levels_.front(), params.min_sounding_sigma_m);
  for (Level& level : out.levels_) noise.Weigh(&level);
  const std::optional<float> scatter = MedianScatter(out.levels_.front());
  if (!scatter) return RegistrationSubmap();
  out.sounding_sigma_m_ =
      std::max(std::sqrt(static_cast<double>(*scatter)), params.min_sounding_sigma_m);
  return out;
}

}  // namespace seastitch
