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

}  // namespace seastitch
