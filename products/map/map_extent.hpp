#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>

#include "products/geo/map_projection.hpp"
#include "products/survey.hpp"

namespace seastitch {

// Rectangle of the submaps at `poses`: north, east of the projection [m].
Eigen::AlignedBox2d BoxOf(const Survey& survey,
                          const SurveyPoses& poses,
                          const MapProjection& projection);

// Middle of the submaps as navigated, in the map frame; without submaps of the track.
Eigen::Vector2d MiddleOf(const Survey& survey);

// Whether a solution scatters the submaps so far that it cannot be right, and would make a grid of
// nothing.
bool IsWild(const Eigen::AlignedBox2d& with_solved, const Eigen::AlignedBox2d& dead_reckoned);

// Side of a cell [m]: cell_m, or where that is 0 the finest that suits the soundings with at most
// max_cells cells. Throws std::runtime_error where cell_m makes more.
double ChooseCell(const Survey& survey,
                  const Eigen::AlignedBox2d& box,
                  double cell_m,
                  std::size_t max_cells);

}  // namespace seastitch
