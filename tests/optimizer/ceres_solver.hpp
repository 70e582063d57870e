#pragma once

#include <ceres/ceres.h>

#include <vector>

#include "optimizer/factor_graph.hpp"

// A graph solved by Ceres, which finds its own derivatives and knows nothing of ours. Between
// vertices only, plain squares, vertex 0 held, the errors of mounting with the last one where there
// are any.
namespace seastitch {

struct BetweenResidual {
  const RelativePoseCost& cost;
  const Eigen::Matrix3d& by_mounting;

  template <class T>
  bool operator()(const T* i, const T* j, const T* mounting, T* residual) const {
    using std::cos;
    using std::sin;
    const auto by = [&](int r) {
      return by_mounting(r, 0) * mounting[0] + by_mounting(r, 1) * mounting[1] +
             by_mounting(r, 2) * mounting[2];
    };
    const T dx = j[0] - i[0];
    const T dy = j[1] - i[1];
    const T e[3] = {cos(i[2]) * dx + sin(i[2]) * dy - cost.T_i_j.x - by(0),
                    -sin(i[2]) * dx + cos(i[2]) * dy - cost.T_i_j.y - by(1),
                    j[2] - i[2] - cost.T_i_j.yaw};
    // The survey turns through half a circle: the near one of the equal angles.
    const T yaw = e[2] - 2.0 * kPi * ceres::floor(e[2] / (2.0 * kPi) + 0.5);
    for (int r = 0; r < 3; ++r)
      residual[r] = cost.W(r, 0) * e[0] + cost.W(r, 1) * e[1] + cost.W(r, 2) * yaw;
    return true;
  }
};

struct PriorResidual {
  const RelativePoseCost& cost;

  template <class T>
  bool operator()(const T* value, T* residual) const {
    for (int r = 0; r < 3; ++r) residual[r] = cost.W(r, r) * value[r];
    return true;
  }
};

inline std::vector<Pose2> SolveWithCeres(const FactorGraph& graph,
                                         const std::vector<Pose2>& start,
                                         double tolerance) {
  std::vector<Eigen::Vector3d> blocks;
  for (const Pose2& pose : start) blocks.push_back(pose.Vector());
  const auto at = [&](int vertex) { return blocks[static_cast<std::size_t>(vertex)].data(); };
  Eigen::Vector3d none = Eigen::Vector3d::Zero();
  double* const mounting = graph.mounting_vertex < 0 ? none.data() : at(graph.mounting_vertex);
  ceres::Problem problem;
  for (const Factor& f : graph.factors) {
    if (f.i == kMap)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PriorResidual, 3, 3>(new PriorResidual{f.cost}),
          nullptr,
          mounting);
    else
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BetweenResidual, 3, 3, 3, 3>(
                                   new BetweenResidual{f.cost, f.by_mounting}),
                               nullptr,
                               at(f.i),
                               at(f.j),
                               mounting);
  }
  if (graph.mounting_vertex < 0 && problem.HasParameterBlock(mounting))
    problem.SetParameterBlockConstant(mounting);
  problem.SetParameterBlockConstant(blocks[0].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = tolerance;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  std::vector<Pose2> poses;
  for (const Eigen::Vector3d& block : blocks) poses.push_back({block.x(), block.y(), block.z()});
  return poses;
}

}  // namespace seastitch
