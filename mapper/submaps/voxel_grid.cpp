#include "mapper/submaps/voxel_grid.hpp"

namespace seastitch {

PointCloud VoxelGrid::Centroids() const {
  PointCloud cloud;
  cloud.points.reserve(voxels_.size());
  cloud.soundings.reserve(voxels_.size());
  for (const Voxel& voxel : voxels_) {
    const auto n = static_cast<double>(voxel.soundings);
    cloud.Add((voxel.sum / n).cast<float>(), static_cast<float>(n));
  }
  return cloud;
}

}  // namespace seastitch
