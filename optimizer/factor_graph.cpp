#include "optimizer/factor_graph.hpp"

namespace seastitch {

Eigen::Vector3d Residual(const Factor& factor, const std::vector<Pose2>& T_map_vertex) {
  const Pose2 T_map_i =
      factor.i == kMap ? Pose2{} : T_map_vertex[static_cast<std::size_t>(factor.i)];
  const Pose2& T_map_j = T_map_vertex[static_cast<std::size_t>(factor.j)];
  return factor.cost.Evaluate(T_map_i, T_map_j, nullptr, nullptr);
}

}  // namespace seastitch
