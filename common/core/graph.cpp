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

Eigen::Matrix3d ByMounting(const GraphEdge& edge) {
  if (edge.from == edge.to) return PositionByMounting(edge.T_from_to.yaw);
  return edge.kind == EdgeKind::kLoopClosure
             ? LoopClosureByMounting(edge.T_from_to, edge.overlap_center_m)
             : DeadReckoningByMounting(edge.T_from_to);
}

}  // namespace seastitch
