#include "optimizer/solver/factor_graph.hpp"

namespace seastitch {

std::array<int, 4> Factor::Ends() const {
  const auto end = [](const MountingTerm& term) { return term.IsZero() ? kMap : term.vertex; };
  return {i, j, end(mounting[0]), end(mounting[1])};
}

Eigen::Vector3d Residual(const Factor& factor, const EndPoses& at, EndJacobians* J) {
  const Eigen::Vector3d& i = at[0];
  const Eigen::Vector3d& j = at[1];
  const Eigen::Matrix2d R_i_map = Eigen::Rotation2Dd(-i.z()).toRotationMatrix();
  const Eigen::Vector2d p_i = R_i_map * (j - i).head<2>();
  if (J != nullptr) {
    Eigen::Matrix3d by_i = -Eigen::Matrix3d::Identity();
    by_i.topLeftCorner<2, 2>() = -R_i_map;
    by_i(0, 2) = p_i.y();  // d(R^T p)/dyaw = (y, -x) of R^T p
    by_i(1, 2) = -p_i.x();
    Eigen::Matrix3d by_j = Eigen::Matrix3d::Identity();
    by_j.topLeftCorner<2, 2>() = R_i_map;
    *J = {factor.W * by_i,
          factor.W * by_j,
          -factor.W * factor.mounting[0].by,
          -factor.W * factor.mounting[1].by};
  }
  Eigen::Vector3d e;
  e << p_i - factor.T_i_j.Translation(), WrapAngle(j.z() - i.z() - factor.T_i_j.yaw);
  return factor.W * (e - factor.mounting[0].by * at[2] - factor.mounting[1].by * at[3]);
}

Eigen::Vector3d Residual(const Factor& factor,
                         const std::vector<Pose2>& T_map_vertex,
                         EndJacobians* J) {
  EndPoses at;
  at.fill(Eigen::Vector3d::Zero());
  const std::array<int, 4> ends = factor.Ends();
  for (std::size_t e = 0; e < ends.size(); ++e)
    if (ends[e] != kMap) at[e] = T_map_vertex[static_cast<std::size_t>(ends[e])].Vector();
  return Residual(factor, at, J);
}

}  // namespace seastitch
