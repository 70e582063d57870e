#pragma once

#include <Eigen/Core>

#include "common/core/submap.hpp"

namespace seastitch {

// The points of a cloud in its level frame, without those that are not finite. R_level_submap:
// LevelFromBody().
inline PointCloud LevelCloud(const PointCloud& cloud, const Eigen::Matrix3d& R_level_submap) {
  PointCloud level;
  const Eigen::Matrix3f R = R_level_submap.cast<float>();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p = R * cloud.points[i];
    if (p.allFinite()) level.Add(p, cloud.soundings[i]);
  }
  return level;
}

}  // namespace seastitch
