#pragma once

#include <Eigen/Core>

#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "mapper/navigation/navigation.hpp"

// Edges for the position of a submap in the map itself. `frame`: the vehicle at the submap's frame,
// by dead reckoning.
namespace seastitch {

// Of the first submap: how well x, y are known there. Its yaw is the vertex's own business
// (GraphVertex::heading_sigma_rad).
GraphEdge StartEdge(SubmapId submap, const NavState& frame);

// A fix at another time, carried to the submap by dead reckoning: with l the vehicle's place at the
// fix in the axes of the submap,
//   fix = p_submap + R(yaw_submap) l
// which informs two directions of (x, y, yaw): more of yaw, the farther the fix is.
// covariance_frame_fix: of (x, y, yaw) of the vehicle at the fix relative to the submap, in its
// axes (Navigation::RelativeCovariance).
GraphEdge FixEdge(SubmapId submap,
                  const NavState& frame,
                  const MapFix& fix,
                  const NavState& at_fix,
                  const Eigen::Matrix3d& covariance_frame_fix);

}  // namespace seastitch
