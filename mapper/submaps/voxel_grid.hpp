#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/submap.hpp"
#include "mapper/submaps/cell_index.hpp"

namespace seastitch {

// First and last of the pings behind some points, counted from any. Empty to begin with.
struct PingSpan {
  std::uint32_t first = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t last = 0;

  void Add(const PingSpan& other) {
    first = std::min(first, other.first);
    last = std::max(last, other.last);
  }
  bool HasTwo() const { return first < last; }
};

// Thins soundings as they come: one weighted centroid a voxel, with the number of soundings and the
// pings behind it.
// Memory follows the seabed seen, not the soundings read. Axes: those of the map.
class VoxelGrid {
 public:
  // `origin`: corner of a voxel [m]. Two submaps have different ones on purpose: voxels that are
  // aligned with each other would draw registration towards whole voxels.
  VoxelGrid(const Eigen::Vector3d& p_map_origin, double voxel_m)
      : p_map_origin_(p_map_origin), voxel_m_(voxel_m) {}

  // weight: above 0, such as the inverse of the sounding's variance. Gives the number of its
  // voxel: its centroid's place in Centroids().
  std::size_t Add(const Eigen::Vector3d& p_map, double weight, std::uint32_t ping) {
    const Eigen::Vector3d p = p_map - p_map_origin_;
    const std::size_t i = cells_.FindOrAdd(
        {CellOf(p.x(), voxel_m_), CellOf(p.y(), voxel_m_), CellOf(p.z(), voxel_m_)});
    if (i == voxels_.size()) voxels_.emplace_back();
    voxels_[i].sum += weight * p;
    voxels_[i].weight += weight;
    ++voxels_[i].soundings;
    voxels_[i].pings.Add({ping, ping});
    ++soundings_;
    return i;
  }

  // Centroids, relative to the origin, in the order in which the voxels were first hit.
  PointCloud Centroids() const;
  // Of each centroid.
  std::vector<PingSpan> Pings() const;

  std::size_t size() const { return voxels_.size(); }
  std::size_t soundings() const { return soundings_; }
  const Eigen::Vector3d& p_map_origin() const { return p_map_origin_; }

 private:
  struct Voxel {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0.0;
    std::size_t soundings = 0;
    PingSpan pings;
  };

  Eigen::Vector3d p_map_origin_;
  double voxel_m_;
  CellIndex cells_;
  std::vector<Voxel> voxels_;
  std::size_t soundings_ = 0;
};

}  // namespace seastitch
