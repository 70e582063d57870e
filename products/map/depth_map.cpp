#include "products/map/depth_map.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/median.hpp"

namespace seastitch {
namespace {

double Square(double x) { return x * x; }

}  // namespace

void DepthCell::Add(double depth_m, double weight) {
  soundings += static_cast<float>(weight);
  ++points;
  const double delta = depth_m - mean_m;
  mean_m += delta * weight / static_cast<double>(soundings);
  squares_m2 += static_cast<float>(weight * delta * (depth_m - mean_m));
}

double DepthCell::Spread() const {
  return points > 0 ? std::sqrt(std::max(0.0, static_cast<double>(squares_m2 / soundings))) : 0.0;
}

void DepthMap::Add(const std::vector<MapPoint>& points,
                   const SubmapErrors& errors,
                   double reference_m) {
  const GridGeometry& g = cells_.geometry();
  const auto row_of = [&](const MapPoint& point) {
    return std::clamp(g.Row(point.north_east.x()), 0, g.rows - 1);
  };
  const auto col_of = [&](const MapPoint& point) {
    return std::clamp(g.Col(point.north_east.y()), 0, g.cols - 1);
  };
  // Sums over the soundings of this submap, in the rows and columns that it reaches.
  struct OfSubmap {
    float soundings = 0.0f, altitudes_m = 0.0f;
  };
  GridGeometry reach = g;
  int row_0 = g.rows, row_1 = -1, col_0 = g.cols, col_1 = -1;
  for (const MapPoint& point : points) {
    row_0 = std::min(row_0, row_of(point));
    row_1 = std::max(row_1, row_of(point));
    col_0 = std::min(col_0, col_of(point));
    col_1 = std::max(col_1, col_of(point));
  }
  reach.rows = std::max(0, row_1 - row_0 + 1);
  reach.cols = std::max(0, col_1 - col_0 + 1);
  Grid<OfSubmap> of_submap(reach);
  for (const MapPoint& point : points) {
    const int row = row_of(point), col = col_of(point);
    cells_(row, col).Add(point.p_ned.z(), point.soundings);
    OfSubmap& here = of_submap(row - row_0, col - col_0);
    here.soundings += static_cast<float>(point.soundings);
    here.altitudes_m +=
        static_cast<float>(point.soundings * std::abs(point.p_ned.z() - reference_m));
  }
  for (int row = 0; row < reach.rows; ++row)
    for (int col = 0; col < reach.cols; ++col) {
      const OfSubmap& here = of_submap(row, col);
      Shared& shared = shared_(row + row_0, col + col_0);
      shared.height_m2 +=
          static_cast<float>(Square(errors.height_ratio * static_cast<double>(here.altitudes_m)));
      shared.north_m2 += here.soundings * static_cast<float>(Square(errors.north_m));
      shared.east_m2 += here.soundings * static_cast<float>(Square(errors.east_m));
    }
}

std::uint64_t DepthMap::CountSeen() const {
  return static_cast<std::uint64_t>(
      std::count_if(cells_.cells().begin(), cells_.cells().end(), [](const DepthCell& cell) {
        return cell.points > 0;
      }));
}

Raster DepthMap::Make(const char* description, const char* unit) const {
  Raster raster;
  raster.description = description;
  raster.unit = unit;
  raster.values.assign(cells_.cells().size(), kNoData);
  return raster;
}

Raster DepthMap::Elevation() const {
  Raster raster = Make("elevation, positive up", "m");
  raster.is_vertical = true;
  for (std::size_t i = 0; i < raster.values.size(); ++i)
    if (const DepthCell& cell = cells_.cells()[i]; cell.points > 0)
      raster.values[i] = static_cast<float>(-cell.mean_m);
  return raster;
}

Raster DepthMap::Spread() const {
  Raster raster = Make("standard deviation of the depths within the cell", "m");
  for (std::size_t i = 0; i < raster.values.size(); ++i)
    if (const DepthCell& cell = cells_.cells()[i]; cell.points > 1)
      raster.values[i] = static_cast<float>(cell.Spread());
  return raster;
}

Raster DepthMap::Density() const {
  Raster raster = Make("soundings", "");
  raster.type = RasterType::kCount;
  for (std::size_t i = 0; i < raster.values.size(); ++i)
    if (const DepthCell& cell = cells_.cells()[i]; cell.points > 0)
      raster.values[i] = cell.soundings;
  return raster;
}

// The median over cells of the variance of a point about the mean of its cell.
double DepthMap::TypicalVariance() const {
  std::vector<double> variances;
  for (const DepthCell& cell : cells_.cells())
    if (cell.points > 1)
      variances.push_back(Square(cell.Spread()) * cell.points / (cell.points - 1.0));
  return variances.empty() ? 0.0 : Median(std::move(variances));
}

// Increase of depth per metre to the north and to the east, from the cells beside this one.
Eigen::Vector2d DepthMap::Slope(int row, int col) const {
  const GridGeometry& g = cells_.geometry();
  const auto between = [&](int row_0, int col_0, int row_1, int col_1) {
    const auto or_here = [&](int r, int c) {
      return g.Contains(r, c) && cells_(r, c).points > 0 ? std::pair(r, c) : std::pair(row, col);
    };
    const auto [r0, c0] = or_here(row_0, col_0);
    const auto [r1, c1] = or_here(row_1, col_1);
    const double length_m = g.cell_m * ((r1 - r0) + (c1 - c0));
    return length_m > 0.0 ? (cells_(r1, c1).mean_m - cells_(r0, c0).mean_m) / length_m : 0.0;
  };
  return {between(row - 1, col, row + 1, col), between(row, col - 1, row, col + 1)};
}

Raster DepthMap::Uncertainty(const MapErrors& errors) const {
  // A cell of few points borrows from the survey, as if it had these in addition.
  constexpr double kBorrowed = 3.0;
  const double typical_m2 = TypicalVariance();
  Raster raster = Make("uncertainty of the elevation, 1 sigma", "m");
  const GridGeometry& g = cells_.geometry();
  for (int row = 0; row < g.rows; ++row)
    for (int col = 0; col < g.cols; ++col) {
      const DepthCell& cell = cells_(row, col);
      if (cell.points == 0) continue;
      const Shared& shared = shared_(row, col);
      const double n = cell.points, weight = static_cast<double>(cell.soundings);
      const double point_m2 =
          (kBorrowed * typical_m2 + n * Square(cell.Spread())) / (kBorrowed + n - 1.0);
      const Eigen::Vector2d slope = Slope(row, col);
      const double variance_m2 = Square(errors.depth_m) +
                                 std::max(1.0, errors.sounding_variance_ratio) * point_m2 / n +
                                 static_cast<double>(shared.height_m2) / (weight * weight) +
                                 Square(slope.x()) * static_cast<double>(shared.north_m2) / weight +
                                 Square(slope.y()) * static_cast<double>(shared.east_m2) / weight;
      raster.values[g.Index(row, col)] = static_cast<float>(std::sqrt(variance_m2));
    }
  return raster;
}

}  // namespace seastitch
