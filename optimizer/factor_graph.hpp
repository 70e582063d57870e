#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "optimizer/graduated_loss.hpp"
#include "optimizer/relative_pose_cost.hpp"

namespace seastitch {

// In place of a vertex: there is none.
constexpr int kMap = -1;

// A measurement of the pose of j relative to i; i == kMap: of the pose of j in the map.
struct Factor {
  int i = kMap;
  int j = 0;
  RelativePoseCost cost{};
  GraduatedLoss loss{};
  int group_size = 1;    // correlated factors around it, this one included
  bool is_step = false;  // of dead reckoning, x, y and yaw
  // The measurement is true less by_mounting (sonar_m, dvl_yaw_rad): see MountingErrors. Its third
  // row is zero.
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

// The derivatives of a residual by the three ends of its factor.
using EndJacobians = std::array<Eigen::Matrix3d, 3>;

// W e of a factor, the errors of mounting taken off. J may be null.
Eigen::Vector3d Residual(const Factor& factor,
                         const Pose2& T_map_i,
                         const Pose2& T_map_j,
                         const Eigen::Vector3d& mounting,
                         EndJacobians* J);
// The same at these poses; J is zero for ends that are not free to move.
Eigen::Vector3d Residual(const FactorGraph& graph,
                         const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J = nullptr);

}  // namespace seastitch
