#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.hpp"
#include "optimizer/graduated_loss.hpp"
#include "optimizer/relative_pose_cost.hpp"

namespace seastitch {

// One statement on the pose of j relative to i; i == kMap: on the pose of j in the map.
constexpr int kMap = -1;
struct Factor {
  int i = kMap;
  int j = 0;
  RelativePoseCost cost{};
  GraduatedLoss loss{};
  int cluster_size = 1;  // how many, this one included, are so near that they may share one error
  bool is_step = false;  // of dead reckoning, x, y and yaw
  // What is stated is true less by_mounting (sonar_m, dvl_yaw_rad): see MountingErrors. Its third
  // row is zero.
  Eigen::Matrix3d by_mounting = Eigen::Matrix3d::Zero();
};

// Vertices are numbered from 0.
struct FactorGraph {
  int num_vertices = 0;
  int fixed_vertex = -1;  // held where it is; -1: none
  std::vector<Factor> factors;
  // Stands for (sonar_m, dvl_yaw_rad) and for no pose; -1: none is sought.
  int mounting_vertex = -1;
};

// (sonar_m, dvl_yaw_rad); zero where none is sought.
Eigen::Vector3d MountingIn(const FactorGraph& graph, const std::vector<Pose2>& T_map_vertex);

// W e of one factor, the errors of mounting taken off.
Eigen::Vector3d Residual(const FactorGraph& graph,
                         std::size_t factor,
                         const std::vector<Pose2>& T_map_vertex);

}  // namespace seastitch
