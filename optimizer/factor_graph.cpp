#include "optimizer/factor_graph.hpp"

namespace seastitch {

std::array<int, 3> FactorGraph::EndsOf(const Factor& factor) const {
  return {factor.i, factor.j, factor.by_mounting.isZero(0.0) ? kMap : mounting_vertex};
}

Eigen::Vector3d Residual(const Factor& factor,
                         const Pose2& T_map_i,
                         const Pose2& T_map_j,
                         const Eigen::Vector3d& mounting,
                         EndJacobians* J) {
  const Eigen::Matrix3d by_mounting = -factor.cost.W * factor.by_mounting;
  if (J != nullptr) (*J)[2] = by_mounting;
  return factor.cost.Evaluate(T_map_i, T_map_j, J ? &(*J)[0] : nullptr, J ? &(*J)[1] : nullptr) +
         by_mounting * mounting;
}

Eigen::Vector3d Residual(const FactorGraph& graph,
                         const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J) {
  const std::array<int, 3> ends = graph.EndsOf(factor);
  std::array<Pose2, 3> at;
  for (std::size_t e = 0; e < ends.size(); ++e)
    if (ends[e] != kMap) at[e] = T_map_vertex[static_cast<std::size_t>(ends[e])];
  const Eigen::Vector3d residual = Residual(factor, at[0], at[1], at[2].Vector(), J);
  for (std::size_t e = 0; J != nullptr && e < ends.size(); ++e)
    if (ends[e] == kMap || ends[e] == graph.fixed_vertex) (*J)[e].setZero();
  return residual;
}

}  // namespace seastitch
