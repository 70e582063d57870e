#pragma once

#include <Eigen/Core>

#include "common/core/graph.hpp"
#include "common/core/sensors.hpp"
#include "mapper/navigation/navigation.hpp"

// Edges that constrain the position of a submap in the map. `frame`: dead-reckoned state of the
// vehicle at the submap's frame.
namespace seastitch {

// Edge of the first submap: position and its uncertainty. Its yaw is not included; the vertex has
// the sigma of it (GraphVertex::heading_sigma_rad).
GraphEdge StartEdge(SubmapId submap, const NavState& frame, bool from_fix = false);

// Edge of a fix at another time, carried to the submap by dead reckoning. With l the vehicle's
// position at the fix in the axes of the submap,
//   fix = p_submap + R(yaw_submap) l
// so that the fix informs two directions of (x, y, yaw), with more weight on yaw the farther it is.
// covariance_frame_fix: of (x, y, yaw) of the vehicle at the fix relative to the submap, in its
// axes (Navigation::RelativeCovariance).
GraphEdge FixEdge(SubmapId submap,
                  const NavState& frame,
                  const MapFix& fix,
                  const NavState& at_fix,
                  const Eigen::Matrix3d& covariance_frame_fix);

}  // namespace seastitch
