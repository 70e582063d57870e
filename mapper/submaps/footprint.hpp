#pragma once

#include <Eigen/Core>

#include "common/core/submap.hpp"

namespace seastitch {

// Most corners of an outline: bounds the size of messages and the time of intersections.
constexpr std::size_t kMaxOutlineCorners = 100;

// Outline of the seabed that a level cloud (LevelCloud()) covers: concave, without holes, the
// largest piece where the cloud falls apart. It encloses the cells of a grid that follows the
// density of the points, so it reaches up to one such cell beyond the outermost point. The order of
// points does not matter. Empty for a cloud without an area.
Footprint FootprintOf(const PointCloud& level);

// Area [m2], positive for either order of the corners.
double Area(const Footprint& footprint);

}  // namespace seastitch
