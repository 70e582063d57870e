#include "optimizer/factor_graph.hpp"

namespace seastitch {

Eigen::Vector3d MountingIn(const FactorGraph& graph, const std::vector<Pose2>& T_map_vertex) {
  if (graph.mounting_vertex < 0) return Eigen::Vector3d::Zero();
  return T_map_vertex[static_cast<std::size_t>(graph.mounting_vertex)].Vector();
}

Eigen::Vector3d Residual(const FactorGraph& graph,
                         std::size_t factor,
                         const std::vector<Pose2>& T_map_vertex) {
  const Factor& f = graph.factors[factor];
  const Pose2 T_map_i = f.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(f.i)];
  const Pose2& T_map_j = T_map_vertex[static_cast<std::size_t>(f.j)];
  return f.cost.Evaluate(T_map_i, T_map_j, nullptr, nullptr) -
         f.cost.W * (f.by_mounting * MountingIn(graph, T_map_vertex));
}

}  // namespace seastitch
