#pragma once

#include <Eigen/Core>

#include "common/core/submap.hpp"

namespace seastitch {

// A message and an intersection stay cheap with so many corners.
constexpr std::size_t kMaxOutlineCorners = 100;

// True outline of the seabed a cloud covers, in its level frame: concave, without holes, the
// largest piece where the cloud falls apart. It encloses the cells of a grid that follows the
// density of the points, so it reaches up to one such cell beyond the outermost point. Works for
// any cloud: no order of pings is asked for. Empty for a cloud without an area.
// R_level_submap: see LevelFromBody(). Points that are not finite are left out.
Footprint FootprintOf(const PointCloud& cloud, const Eigen::Matrix3d& R_level_submap);

// [m2]; positive whichever way the corners go round.
double Area(const Footprint& footprint);

}  // namespace seastitch
