#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "mapper/registration/registration.hpp"
#include "mapper/registration/smoothing.hpp"

namespace seastitch {
namespace {

// Sums over the soundings of a cell; x and y from the middle of the cloud, z from its mean.
enum Moment { kN, kX, kY, kXX, kXY, kYY, kZ, kXZ, kYZ, kZZ, kPoints, kUnused, kNumMoments };
using Moments = Eigen::Array<double, kNumMoments, 1>;

// Points under a kernel of unit peak; they weigh as twice as many alike. Fewer make no plane.
constexpr double kMinPoints = 2.0;
// Least spread of the soundings under a kernel in any direction, in cells (1 where they are even).
constexpr double kMinSpreadCells = 0.4;

struct Sounding {
  Eigen::Vector3d p;
  double n;
};

std::vector<Sounding> UsableSoundings(const PointCloud& cloud, const Eigen::Matrix3d& R) {
  std::vector<Sounding> out;
  if (!R.allFinite()) return out;
  out.reserve(cloud.size());
  const std::size_t size = std::min(cloud.points.size(), cloud.soundings.size());
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    const float n = cloud.soundings[i];
    // A float of 1e9 m is no sounding, and its square would drown the others.
    if (!(p.allFinite() && p.cwiseAbs().maxCoeff() < 1e6f && n > 0.0f && n < 1e9f)) continue;
    out.push_back({R * p.cast<double>(), n});
  }
  return out;
}

struct Box {
  Eigen::Vector2d min;
  Eigen::Vector2d max;
  Eigen::Vector2d Size() const { return max - min; }
  bool Contains(const Eigen::Vector3d& p) const {
    return (p.head<2>().array() >= min.array()).all() && (p.head<2>().array() <= max.array()).all();
  }
};

Box BoundingBox(const std::vector<Sounding>& soundings) {
  Box box{soundings.front().p.head<2>(), soundings.front().p.head<2>()};
  for (const Sounding& s : soundings) {
    box.min = box.min.cwiseMin(s.p.head<2>());
    box.max = box.max.cwiseMax(s.p.head<2>());
  }
  return box;
}

// Where all but the outermost 0.5 % on every side lie, with as much again as a margin of a fifth.
Box CoreBox(const std::vector<Sounding>& soundings) {
  Box box;
  std::vector<double> values(soundings.size());
  const std::size_t cut = soundings.size() / 200;
  for (int axis = 0; axis < 2; ++axis) {
    std::transform(soundings.begin(), soundings.end(), values.begin(), [&](const Sounding& s) {
      return s.p[axis];
    });
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(cut);
    std::nth_element(values.begin(), low, values.end());
    box.min[axis] = *low;
    const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(cut);
    std::nth_element(values.begin(), high, values.end());
    box.max[axis] = *high;
  }
  const Eigen::Vector2d margin = 0.2 * box.Size();
  box.min -= margin;
  box.max += margin;
  return box;
}

double CellsOf(const Box& box, double cell_m) {
  return (box.Size().x() / cell_m + 2.0) * (box.Size().y() / cell_m + 2.0);
}

// Mean distance of neighbouring points: from the area of the cells of a trial grid that hold any.
double PointSpacing(const std::vector<Sounding>& soundings, const Box& box) {
  const double count = static_cast<double>(soundings.size());
  const Eigen::Vector2d size = box.Size();
  const double trial_cell =
      std::max({3.0 * std::sqrt(size.x() * size.y() / count), size.maxCoeff() / 2000.0, 1e-3});
  const GridGeometry g = GridGeometry::Covering(box.min, box.max, trial_cell);
  std::vector<char> occupied(g.size(), 0);
  std::size_t inside = 0;
  for (const Sounding& s : soundings) {
    if (!box.Contains(s.p)) continue;
    occupied[g.Index(g.Row(s.p.x()), g.Col(s.p.y()))] = 1;
    ++inside;
  }
  const auto cells = std::count(occupied.begin(), occupied.end(), 1);
  return trial_cell * std::sqrt(static_cast<double>(cells) / static_cast<double>(inside));
}

// The finest level whose cells are at least so large.
int LevelAtLeast(double cell_m) { return static_cast<int>(std::ceil(std::log2(cell_m) - 1e-9)); }
double CellOf(int level) { return std::exp2(level); }

struct RawLevel {
  GridGeometry geometry;
  Eigen::Vector2d middle;  // of the cloud: where kX, kY count from
  std::vector<Moments> cells;
};

RawLevel Bin(const std::vector<Sounding>& soundings, const Box& box, double cell, double datum) {
  RawLevel raw;
  raw.geometry = GridGeometry::Covering(box.min, box.max, cell);
  raw.middle = 0.5 * (box.min + box.max);
  raw.cells.assign(raw.geometry.size(), Moments::Zero());
  for (const Sounding& s : soundings) {
    if (!box.Contains(s.p)) continue;
    const double x = s.p.x() - raw.middle.x();
    const double y = s.p.y() - raw.middle.y();
    const double z = s.p.z() - datum;
    Moments m;
    m << 1.0, x, y, x * x, x * y, y * y, z, x * z, y * z, z * z, 0.0, 0.0;
    m *= s.n;
    m[kPoints] = 1.0;
    const GridGeometry& g = raw.geometry;
    raw.cells[g.Index(g.Row(s.p.x()), g.Col(s.p.y()))] += m;
  }
  return raw;
}

// The same sums in cells of twice the size.
RawLevel Coarsen(const RawLevel& fine) {
  const GridGeometry& f = fine.geometry;
  RawLevel raw;
  raw.middle = fine.middle;
  raw.geometry =
      GridGeometry::Covering(f.Center(0, 0), f.Center(f.rows - 1, f.cols - 1), 2.0 * f.cell_m);
  raw.cells.assign(raw.geometry.size(), Moments::Zero());
  // Corners lie on multiples of the cell, so cells pair off from an even or an odd one.
  const int odd_row = raw.geometry.Row(f.Center(1, 0).x());
  const int odd_col = raw.geometry.Col(f.Center(0, 1).y());
  for (int row = 0; row < f.rows; ++row)
    for (int col = 0; col < f.cols; ++col)
      raw.cells[raw.geometry.Index((row + odd_row) / 2, (col + odd_col) / 2)] +=
          fine.cells[f.Index(row, col)];
  return raw;
}

// Plane under a kernel: height and slope at p, by weighted least squares.
struct PlaneFit {
  double height;
  Eigen::Vector2d slope;
  double variance;           // of the height, from soundings of unit variance
  double residual_variance;  // unbiased, of a single sounding
};

std::optional<PlaneFit> FitPlane(const Moments& m,
                                 const Eigen::Vector2d& p,
                                 double cell,
                                 double peak) {
  // kPoints counts the points under a kernel of unit sum; over the peak, of unit peak.
  if (!(m[kPoints] >= kMinPoints * peak)) return std::nullopt;
  const double inverse_n = 1.0 / m[kN];
  const Moments mean = m * inverse_n;
  const double xx = mean[kXX] - mean[kX] * mean[kX];
  const double xy = mean[kXY] - mean[kX] * mean[kY];
  const double yy = mean[kYY] - mean[kY] * mean[kY];
  // The spread in every direction is at least that: its smaller eigenvalue.
  const double least = (kMinSpreadCells * cell) * (kMinSpreadCells * cell);
  if (!(xx >= least && (xx - least) * (yy - least) >= xy * xy)) return std::nullopt;
  const double xz = mean[kXZ] - mean[kX] * mean[kZ];
  const double yz = mean[kYZ] - mean[kY] * mean[kZ];
  const double inverse_determinant = 1.0 / (xx * yy - xy * xy);
  const Eigen::Vector2d lever(p.x() - mean[kX], p.y() - mean[kY]);
  PlaneFit fit;
  fit.slope = inverse_determinant * Eigen::Vector2d(yy * xz - xy * yz, xx * yz - xy * xz);
  fit.height = mean[kZ] + fit.slope.dot(lever);
  const double leverage =
      (yy * lever.x() * lever.x() - 2.0 * xy * lever.x() * lever.y() + xx * lever.y() * lever.y()) *
      inverse_determinant;
  fit.variance = (1.0 + leverage) * inverse_n;
  // The fit takes one of the points from the residual: for a Gaussian, K^2 has half the area and
  // half the spread of K, and 1/2 + 1/4 + 1/4 = 1.
  const double variance = mean[kZZ] - mean[kZ] * mean[kZ] - fit.slope.x() * xz - fit.slope.y() * yz;
  fit.residual_variance = std::max(0.0, variance) * m[kN] / (m[kPoints] - peak);
  return fit;
}

RegistrationSubmap::Level SmoothLevel(int number,
                                      RawLevel raw,
                                      std::vector<double>* residual_variances) {
  const GridGeometry& g = raw.geometry;
  const double peak = SmoothingKernel().Peak();
  RegistrationSubmap::Level level{number, Grid<RegistrationSubmap::Cell>(g)};
  for (std::size_t i = 0; i < raw.cells.size(); ++i)
    level.grid.cells()[i].soundings = static_cast<float>(raw.cells[i][kN]);
  Smooth(g.rows, g.cols, &raw.cells);
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      const auto fit =
          FitPlane(raw.cells[g.Index(row, col)], g.Center(row, col) - raw.middle, g.cell_m, peak);
      if (!fit) continue;
      RegistrationSubmap::Cell& cell = level.grid(row, col);
      cell.height_m = static_cast<float>(fit->height);
      cell.slope_x = static_cast<float>(fit->slope.x());
      cell.slope_y = static_cast<float>(fit->slope.y());
      cell.variance = static_cast<float>(fit->variance);
      if (residual_variances) residual_variances->push_back(fit->residual_variance);
    }
  }
  return level;
}

double Median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace

RegistrationSubmap RegistrationSubmap::Prepare(const PointCloud& cloud,
                                               const Eigen::Matrix3d& R_level_submap,
                                               const RegistrationParams& params) {
  RegistrationSubmap out;
  const std::vector<Sounding> soundings = UsableSoundings(cloud, R_level_submap);
  if (soundings.size() < 16) return out;
  const auto max_cells = static_cast<double>(params.max_cells);
  const auto count = static_cast<double>(soundings.size());
  Box box = BoundingBox(soundings);
  // Ten cells a point and more are mostly empty: something lies far from everything else.
  double spacing = PointSpacing(soundings, box);
  if (CellsOf(box, std::max(spacing, params.min_cell_m)) > std::min(max_cells, 10.0 * count)) {
    box = CoreBox(soundings);
    spacing = PointSpacing(soundings, box);
  }
  int finest = LevelAtLeast(std::max(params.cell_per_spacing * spacing, params.min_cell_m));
  while (CellsOf(box, CellOf(finest)) > max_cells) ++finest;

  double sum_z = 0.0;
  double sum_n = 0.0;
  for (const Sounding& s : soundings) {
    if (!box.Contains(s.p)) continue;
    sum_z += s.n * s.p.z();
    sum_n += s.n;
  }
  out.height_datum_m_ = sum_z / sum_n;

  std::vector<double> residual_variances;
  RawLevel raw = Bin(soundings, box, CellOf(finest), out.height_datum_m_);
  for (int i = 0; i < params.num_levels; ++i) {
    if (i > 0) raw = Coarsen(raw);
    out.levels_.push_back(SmoothLevel(finest + i, raw, i == 0 ? &residual_variances : nullptr));
  }
  if (residual_variances.empty()) return RegistrationSubmap();
  out.sounding_sigma_m_ =
      std::max(std::sqrt(Median(&residual_variances)), params.min_sounding_sigma_m);
  return out;
}

}  // namespace seastitch
