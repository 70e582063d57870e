#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/grid.hpp"
#include "products/geo/raster.hpp"
#include "products/map/map_points.hpp"
#include "products/survey.hpp"

// Consistency of overlapping submaps: two error measures [m], each with one value per grid cell.
//
// 1. The consistency error (point error) of C. Roman and H. Singh, "Consistency based error
// evaluation for deep sea bathymetric mapping with robotic vehicles", ICRA 2006:
//
//   d(p, n)   distance in 3-D from point p to the nearest point of submap n within the 3 x 3 cells
//             around the cell of p
//   e(c; m,n) mean of d(p, n) over the points p of submap m in cell c
//   e(c)      max of e(c; m,n) over all ordered pairs of submaps m, n that both have points in c
//
// A point p is used only if n has points in all four quadrants around p within these 3 x 3 cells.
// Otherwise p lies beyond the edge of n, and d would be its distance from that edge.
//
// Torroba, Bore and Folkesson (IROS 2019) use the same measure. Their program samples points at
// random and divides every survey into the same number of cells. Here all points are used and the
// cell size is given in metres. So the value is reproducible and comparable between surveys.
//
// Between two perfect submaps e is not zero but about half the spacing of neighbouring points,
// which hides smaller errors.
//
// 2. The surface error. As above, with
//
//   d(p, n)   perpendicular distance, unsigned, from p to the plane fitted to the points of n
//             within a horizontal radius of one cell around p
//
// A point p is used only if these are at least five points, in all four quadrants. The measure does
// not depend on the density of the points: between perfect submaps it is the noise of the soundings
// and the roughness of the seabed within a cell.
namespace seastitch {

// Value of a cell without any pair of submaps to compare.
constexpr float kNoValue = -1.0f;

struct ConsistencyMap {
  Grid<float> point_error_m;    // or kNoValue
  Grid<float> surface_error_m;  // or kNoValue
  Grid<std::uint16_t> submaps;  // number of submaps with points in the cell
};

// Computes both errors with the submaps at `poses`. The cells are those of the
// projection; distances are measured in the map frame.
// Memory: the grid, the points of two submaps, and a cache of at most cache_points points (12 bytes
// each). on_submap(i) is called before the pairs of submap i, to show progress.
ConsistencyMap ComputeConsistency(const std::vector<SurveySubmap>& submaps,
                                  const SurveyPoses& poses,
                                  const MapProjection& projection,
                                  const GridGeometry& geometry,
                                  std::size_t cache_points,
                                  const std::function<void(std::size_t)>& on_submap = {});

// The surface error as a raster: the swath mismatch.
Raster Mismatch(const ConsistencyMap& map);

// Statistics over cells. Without any cell, `cells` is 0 and the others are NaN.
struct ErrorFigures {
  double rms_m = 0.0;
  double median_m = 0.0;
  double p95_m = 0.0;
  std::uint64_t cells = 0;
};

struct ConsistencyFigures {
  ErrorFigures point;
  ErrorFigures surface;
};

// Statistics over all cells with a value.
ConsistencyFigures Figures(const ConsistencyMap& map);

// Statistics of `map` over the cells that can be compared with those of `other` (same geometry):
// both have a value there, from the same number of submaps. A solution changes which cells are seen
// twice, and the largest of three errors is larger than the largest of two.
ConsistencyFigures FiguresOfComparableCells(const ConsistencyMap& map, const ConsistencyMap& other);

}  // namespace seastitch
