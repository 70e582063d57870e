#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "optimizer/graduated_loss.hpp"

namespace seastitch {

// Stands for the map in place of a vertex.
constexpr int kMap = -1;

// Measurement of the pose of vertex j relative to vertex i, or (i == kMap) in the map.
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
  bool is_dead_reckoning = false;  // a start, or between two submaps
  bool is_step = false;            // of these, one with x, y and yaw between two submaps
  // Derivative of the measurement by MountingErrors::Vector(), with the sign of true less stated.
  // Its third row is zero.
  Eigen::Matrix3d by_mounting = Eigen::Matrix3d::Zero();

  bool IsRobust() const { return std::isfinite(loss.c2); }
};

// Vertices are numbered from 0.
struct FactorGraph {
  int num_vertices = 0;
  int fixed_vertex = -1;  // is not moved; -1: none
  std::vector<Factor> factors;
  // The vertex that holds (sonar_m, dvl_yaw_rad) instead of a pose; -1: none is estimated.
  int mounting_vertex = -1;

  // Vertices of a factor: i, j, mounting; kMap where it has none.
  std::array<int, 3> EndsOf(const Factor& factor) const;
};

// (x, y, yaw) of the three vertices of a factor, zero where it has none, and the derivatives of its
// residual by them.
using EndPoses = std::array<Eigen::Vector3d, 3>;
using EndJacobians = std::array<Eigen::Matrix3d, 3>;

// W e of a factor. J may be null.
Eigen::Vector3d Residual(const Factor& factor, const EndPoses& at, EndJacobians* J = nullptr);
Eigen::Vector3d Residual(const FactorGraph& graph,
                         const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J = nullptr);

}  // namespace seastitch
