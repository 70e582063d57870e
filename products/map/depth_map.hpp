#pragma once

#include <cstdint>
#include <vector>

#include "common/core/grid.hpp"
#include "products/geo/raster.hpp"
#include "products/map/map_points.hpp"

namespace seastitch {

// Weighted running mean and squared deviation of the depths in a cell (D. H. D. West, "Updating
// mean and variance estimates", CACM 1979): keeps millimetres at 6000 m.
struct DepthCell {
  double mean_m = 0.0;
  float squares_m2 = 0.0f;  // sum of weight * (depth - mean)^2
  float soundings = 0.0f;
  std::uint32_t points = 0;

  void Add(double depth_m, double weight);
  // Standard deviation of the points about their mean. A point may itself be the mean of several
  // soundings, so this is the spread of the map's points, a little below that of the soundings.
  double Spread() const;
};

// 1 sigma of what all soundings of a submap have in common.
struct SubmapErrors {
  double north_m = 0.0;       // position
  double east_m = 0.0;        // position
  double height_ratio = 0.0;  // height error that neighbouring soundings share, by the altitude
};

// 1 sigma of what all soundings of the map have in common, and the noise of a sounding.
struct MapErrors {
  double depth_m = 0.0;  // bias of the vehicle's depth
  // Variance of a sounding, divided by that of soundings about a smooth surface (NoiseEstimate).
  double sounding_variance_ratio = 1.0;
};

// Depth map of a survey, positive down. Each point has the number of its soundings as weight.
class DepthMap {
 public:
  explicit DepthMap(const GridGeometry& geometry) : cells_(geometry) {}
  // The points of one submap. reference_m: depth of its frame, from which its altitudes count.
  void Add(const std::vector<MapPoint>& points, const SubmapErrors& errors, double reference_m);
  const Grid<DepthCell>& cells() const { return cells_; }
  std::uint64_t CountSeen() const;

  // Mean height above the map's zero of depth, positive up.
  Raster Elevation() const;
  // Standard deviation of the depths; no value with one point.
  Raster Spread() const;
  // Number of soundings.
  Raster Density() const;
  // 1 sigma of Elevation(): of the cell's mean by the spread of its points, of the height error
  // that the soundings of a submap share (independent between submaps), of the position by the
  // slope of the map, and of the vehicle's depth (docs/files.md has the formula).
  Raster Uncertainty(const MapErrors& errors) const;

 private:
  // Sums over the submaps of a cell, by weight of their soundings.
  struct Shared {
    float height_m2 = 0.0f;  // of squares: (weight * sigma)^2
    float north_m2 = 0.0f;   // weight * sigma^2
    float east_m2 = 0.0f;
  };
  Raster Make(const char* description, const char* unit) const;
  double TypicalVariance() const;
  Eigen::Vector2d Slope(int row, int col) const;

  Grid<DepthCell> cells_;
  Grid<Shared> shared_{cells_.geometry()};
};

}  // namespace seastitch
