#include "optimizer/factor_graph.hpp"

namespace seastitch {

Eigen::Vector3d Residual(const FactorGraph& graph,
                         std::size_t factor,
                         const std::vector<Pose2>& T_map_vertex) {
  const Factor& f = graph.factors[factor];
  const Pose2 T_map_i = f.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(f.i)];
  const Pose2& T_map_j = T_map_vertex[static_cast<std::size_t>(f.j)];
  const Eigen::Vector3d residual = f.cost.Evaluate(T_map_i, T_map_j, nullptr, nullptr);
  if (graph.mounting_vertex < 0) return residual;
  const Pose2& mounting = T_map_vertex[static_cast<std::size_t>(graph.mounting_vertex)];
  return residual - f.cost.W * (f.by_mounting * mounting.Vector());
}

}  // namespace seastitch
