#include "mapper/submaps/voxel_grid.hpp"

namespace seastitch {

PointCloud VoxelGrid::Centroids() const {
  PointCloud cloud;
  cloud.points.reserve(voxels_.size());
  cloud.soundings.reserve(voxels_.size());
  for (const Voxel& voxel : voxels_) {
    cloud.Add((voxel.sum / voxel.weight).cast<float>(), static_cast<float>(voxel.soundings));
  }
  return cloud;
}

std::vector<PingSpan> VoxelGrid::Pings() const {
  std::vector<PingSpan> pings;
  pings.reserve(voxels_.size());
  for (const Voxel& voxel : voxels_) pings.push_back(voxel.pings);
  return pings;
}

}  // namespace seastitch
