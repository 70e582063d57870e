#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "optimizer/graduated_loss.hpp"

namespace seastitch {

// In place of a vertex: there is none.
constexpr int kMap = -1;

// A measurement of the pose of j relative to i; i == kMap: of the pose of j in the map.
//   e = [ R_i^T (p_j - p_i) - p_ij ;  wrap(yaw_j - yaw_i - yaw_ij) ] - by_mounting (sonar_m,
//   dvl_yaw_rad)
// in m, m, rad and the axes of i. Its residual is W e.
struct Factor {
  int i = kMap;
  int j = 0;
  Pose2 T_i_j{};
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  GraduatedLoss loss{};
  int group_size = 1;              // correlated factors around it, this one included
  bool is_dead_reckoning = false;  // where it starts, or between two submaps
  bool is_step = false;            // of these, with x, y and yaw between two
  // The measurement is true less that of MountingErrors. Its third row is zero.
  Eigen::Matrix3d by_mounting = Eigen::Matrix3d::Zero();

  bool IsRobust() const { return std::isfinite(loss.c2); }
};

// Vertices are numbered from 0.
struct FactorGraph {
  int num_vertices = 0;
  int fixed_vertex = -1;  // held where it is; -1: none
  std::vector<Factor> factors;
  // Stands for (sonar_m, dvl_yaw_rad) and for no pose; -1: none is estimated.
  int mounting_vertex = -1;

  // The vertices that a factor ties together: i, j, mounting; kMap: not there.
  std::array<int, 3> EndsOf(const Factor& factor) const;
};

// By the three ends of a factor: (x, y, yaw) of each, zero where there is none, and the derivatives
// of a residual.
using EndPoses = std::array<Eigen::Vector3d, 3>;
using EndJacobians = std::array<Eigen::Matrix3d, 3>;

// W e of a factor. J may be null.
Eigen::Vector3d Residual(const Factor& factor, const EndPoses& at, EndJacobians* J = nullptr);
Eigen::Vector3d Residual(const FactorGraph& graph,
                         const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J = nullptr);

}  // namespace seastitch
