#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/grid.hpp"
#include "products/map_points.hpp"
#include "products/survey.hpp"

// How well overlapping submaps agree: two measures, each a value a grid cell.
//
// The point error is that of C. Roman and H. Singh, "Consistency based error evaluation for deep
// sea bathymetric mapping with robotic vehicles", ICRA 2006, in the form in which Torroba, Bore and
// Folkesson (IROS 2019) use it: in every grid cell, the largest distance by which one submap's
// points miss another submap. Their program takes it from random points and from a fixed number of
// cells over any survey; here nothing is drawn and cells are metric, so that the figure repeats and
// can be compared between surveys:
//
//   d(p, n)   distance in 3-D from point p to the nearest point of submap n within the 3 x 3 cells
//             around the cell of p; p counts only where n has points in all four quadrants about
//             it there, since past the edge of n the nearest point says how far the edge is
//   e(c; m,n) mean of d(p, n) over the points p of submap m in cell c that count
//   e(c)      max of e(c; m,n) over all ordered pairs of submaps m, n that both have points in c
//
// Between two clean, aligned submaps e is not zero but about half the distance between neighbouring
// points, which hides errors smaller than that. The surface error is the same with
//
//   d(p, n)   distance from p to the plane fitted to the points of n within one cell length of p,
//             horizontally; p counts only where these are at least five and in all four quadrants
//
// and does not depend on how dense the points are: between clean, aligned submaps it is the noise
// of the soundings and the roughness of the seabed within a cell.
namespace seastitch {

constexpr float kNoError = -1.0f;

struct ConsistencyMap {
  Grid<float> point_error_m;    // kNoError where no two submaps meet
  Grid<float> surface_error_m;  // likewise
  Grid<std::uint16_t> submaps;  // how many see the cell
};

// Memory: the grid, and at most cache_points points of the submaps (24 bytes each) beside the two
// at work. on_submap(i) is called before each.
ConsistencyMap ComputeConsistency(const std::vector<SurveySubmap>& submaps,
                                  const SurveyPoses& poses,
                                  MapAxes axes,
                                  const GridGeometry& geometry,
                                  std::size_t cache_points,
                                  const std::function<void(std::size_t)>& on_submap = {});

// Statistics over cells; NaN without a cell.
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

ConsistencyFigures Figures(const ConsistencyMap& map);

// Over the cells that have a value in `other` too (same geometry) and are seen by as many submaps
// there: what two solutions can be compared by, since a solution also changes which cells are seen
// twice, and the largest of three errors is larger than the largest of two.
ConsistencyFigures FiguresWhereAlike(const ConsistencyMap& map, const ConsistencyMap& other);

}  // namespace seastitch
