#include "common/core/graph.hpp"

namespace seastitch {

const char* ToString(EdgeKind kind) {
  switch (kind) {
    case EdgeKind::kDeadReckoning: return "dead_reckoning";
    case EdgeKind::kLoopClosure: return "loop_closure";
    case EdgeKind::kPositionFix: return "position_fix";
  }
  return "unknown";
}

const char* ToString(LoopVerdict verdict) {
  switch (verdict) {
    case LoopVerdict::kAccepted: return "accepted";
    case LoopVerdict::kAmbiguous: return "ambiguous";
    case LoopVerdict::kDegenerate: return "degenerate";
    case LoopVerdict::kPoorFit: return "poor_fit";
    case LoopVerdict::kLittleOverlap: return "little_overlap";
    case LoopVerdict::kOutsideWindow: return "outside_window";
    case LoopVerdict::kNotConverged: return "not_converged";
  }
  return "unknown";
}

EdgeByMounting ByMounting(const GraphEdge& edge, bool of_one_dive) {
  EdgeByMounting by;
  if (edge.from == edge.to) {
    by.of_to = PositionByMounting(edge.T_from_to.yaw);
  } else if (edge.kind != EdgeKind::kLoopClosure) {
    by.of_to = DeadReckoningByMounting(edge.T_from_to);
  } else if (of_one_dive) {
    by.of_to = LoopClosureByMounting(edge.T_from_to, edge.overlap_center_m);
  } else {
    by.of_from = LoopClosureByMountingOfFrom(edge.overlap_center_m);
    by.of_to = LoopClosureByMountingOfTo(edge.T_from_to, edge.overlap_center_m);
    // Half of a shear is a rotation. Two clouds with different shears are turned against each other
    // by half the difference, about the centre of an overlap that is as long as it is wide. The
    // clouds of one dive are turned alike.
    const Eigen::Vector2d arm = edge.overlap_center_m - edge.T_from_to.Translation();
    const Eigen::Vector3d turn(0.5 * arm.y(), -0.5 * arm.x(), 0.5);
    by.of_from.col(2) += turn;
    by.of_to.col(2) -= turn;
  }
  return by;
}

Pose2 MeasuredBy(double newest_dvl_yaw_rad, const GraphEdge& edge, const EdgeByMounting& by) {
  if (edge.from == edge.to) return edge.T_from_to;
  const double learnt_rad = newest_dvl_yaw_rad - edge.dvl_yaw_rad;
  if (edge.kind == EdgeKind::kDeadReckoning)  // exact: a log may be turned by degrees
    return TravelledPose(edge.T_from_to, {.dvl_yaw_rad = learnt_rad});
  const Eigen::Vector3d measured = edge.T_from_to.Vector() + learnt_rad * by.of_to.col(2);
  return {measured.x(), measured.y(), measured.z()};
}

Eigen::Vector3d MountingCorrection(const EdgeByMounting& by,
                                   const MountingErrors& from,
                                   const MountingErrors& to) {
  return by.of_from * from.Vector() + by.of_to * to.Vector();
}

MountingErrors PoseGraph::MountingOf(std::int32_t chain) const {
  const auto found = mounting.find(chain);
  return found == mounting.end() ? MountingErrors{} : found->second;
}

bool IsSolutionDue(std::size_t submaps, std::size_t solved) {
  constexpr std::size_t kSolvedEachTime = 100;
  return submaps <= kSolvedEachTime || (submaps - solved) * kSolvedEachTime >= submaps;
}

}  // namespace seastitch
