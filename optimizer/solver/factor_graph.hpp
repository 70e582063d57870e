#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "optimizer/solver/graduated_loss.hpp"

namespace seastitch {

// Index that denotes the map frame in place of a vertex.
constexpr int kMap = -1;

// How a factor's measurement depends on the mounting errors of one dive.
struct MountingTerm {
  int vertex = kMap;  // the vertex that holds these errors; kMap: they are not estimated
  // Partial derivative of the measurement with respect to MountingErrors::Vector() (true value less
  // configured value). The third row is zero: the dead-reckoned yaw comes from the attitude sensor,
  // which these errors do not concern.
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();

  bool IsZero() const { return vertex == kMap || by.isZero(0.0); }
};

// Measured pose of vertex j relative to vertex i, or relative to the map (i == kMap). Its error is
//   e = [ R_i^T (p_j - p_i) - p_ij ;  wrap(yaw_j - yaw_i - yaw_ij) ] - B_0 b_0 - B_1 b_1
// with b = (sonar_m.x, sonar_m.y, dvl_yaw_rad) of MountingErrors, and B and b of mounting[0] and
// mounting[1]. Units: m, m, rad; axes of i, or of the map. Its residual is W e.
struct Factor {
  int i = kMap;
  int j = 0;
  Pose2 T_i_j{};
  // Square root of the information: W^T W. A row of zeros is a direction that is not measured.
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  GraduatedLoss loss{};
  // Of a loop closure: number of closures whose two submaps are each at most one submap away from
  // this one's, itself included. Their errors are correlated: SolveRobustly() limits how much such
  // a group counts. 1 for all other factors.
  int group_size = 1;
  // The start of a chain by the navigation filter, or a relative pose of two submaps by dead
  // reckoning.
  bool is_dead_reckoning = false;
  // A dead-reckoning edge that measures x, y and yaw (an odometry factor). VarianceFactor() uses
  // these alone.
  bool is_step = false;
  // The second is of a closure between two dives, which depends on the errors of both.
  std::array<MountingTerm, 2> mounting{};

  bool IsRobust() const { return std::isfinite(loss.c2); }
  // Its vertices: i, j and those of its two mounting terms. kMap stands where it has no such
  // vertex.
  std::array<int, 4> Ends() const;
};

// Vertices and the factors between them. Vertices are numbered from 0.
struct FactorGraph {
  int num_vertices = 0;   // mounting vertices included
  int fixed_vertex = -1;  // held constant (gauge); -1: none, the factors hold the gauge
  std::vector<Factor> factors;
  // Number of mounting vertices. They are the last ones, and each holds the mounting errors of one
  // dive (sonar_m.x, sonar_m.y, dvl_yaw_rad) instead of a pose.
  int num_mountings = 0;

  bool IsMounting(int vertex) const { return vertex >= num_vertices - num_mountings; }
};

// Values of the four vertices of Factor::Ends(): (x, y, yaw) of i and of j, then the mounting
// errors of two dives. Zero where the factor has no such vertex.
using EndPoses = std::array<Eigen::Vector3d, 4>;
// Partial derivatives of a residual with respect to them.
using EndJacobians = std::array<Eigen::Matrix3d, 4>;

// Residual W e of a factor at these values of its vertices. J may be null.
Eigen::Vector3d Residual(const Factor& factor, const EndPoses& at, EndJacobians* J = nullptr);
// The same at the values of all vertices of a graph; a mounting vertex holds its three numbers as
// x, y, yaw.
Eigen::Vector3d Residual(const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J = nullptr);

}  // namespace seastitch
