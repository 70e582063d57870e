#include "mapper/nav_correction.hpp"

#include <algorithm>

namespace seastitch {
namespace {

constexpr Eigen::Index kLevelAxes[3] = {0, 1, 5};  // x, y, yaw in the covariance of NAV

Eigen::Matrix3d LevelCovariance(const NavState& nav) {
  Eigen::Matrix3d level;
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index c = 0; c < 3; ++c) level(r, c) = nav.covariance(kLevelAxes[r], kLevelAxes[c]);
  return level;
}

// Depth, roll and pitch stay what they are to NAV; what ties them to the rest is NAV's frame.
void SetLevelCovariance(const Eigen::Matrix3d& level, NavState* nav) {
  const Matrix6d before = nav->covariance;
  nav->covariance.setZero();
  nav->covariance.block<3, 3>(2, 2) = before.block<3, 3>(2, 2);
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index c = 0; c < 3; ++c)
      nav->covariance(kLevelAxes[r], kLevelAxes[c]) = level(r, c);
}

Eigen::Matrix3d Turned(const Eigen::Matrix3d& covariance, double yaw_rad) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  R.topLeftCorner<2, 2>() = Pose2{0.0, 0.0, yaw_rad}.Rotation();
  return R * covariance * R.transpose();
}

}  // namespace

void NavCorrection::Add(const GraphUpdate& update) {
  for (const GraphVertex& vertex : update.vertices)
    frames_[vertex.id] = {vertex.time, vertex.dead_reckoned};
  const bool places = std::any_of(
      update.edges.begin(), update.edges.end(), [](const GraphEdge& e) { return e.from == e.to; });
  if (places && !placed_) placed_ = update.version;
}

void NavCorrection::Take(const PoseGraph& solution) {
  const auto newest = std::find_if(
      solution.vertices.rbegin(), solution.vertices.rend(), [this](const SolvedVertex& vertex) {
        return frames_.contains(vertex.id);
      });
  if (newest == solution.vertices.rend()) return;
  const std::optional<CorrectedNavState> before = Now();
  anchor_ = Anchor{frames_.at(newest->id),
                   VehiclePose(newest->T_map_level, solution.mounting),
                   newest->covariance,
                   solution.mounting,
                   placed_ && *placed_ <= solution.graph_version};
  graph_version_ = solution.graph_version;
  frames_.erase(frames_.begin(), frames_.find(newest->id));
  const std::optional<CorrectedNavState> after = Now();
  if (!before || !after) return;
  const Pose2 a = LevelPose(before->state.T_map_vehicle);
  const Pose2 b = LevelPose(after->state.T_map_vehicle);
  ++jumps_;
  last_jump_m_ = (b.Translation() - a.Translation()).norm();
  last_jump_yaw_rad_ = WrapAngle(b.yaw - a.yaw);
}

Pose2 NavCorrection::Corrected(const Pose2& T_nav_vehicle) const {
  if (!anchor_) return T_nav_vehicle;
  const Pose2 way = Inverse(anchor_->frame.dead_reckoned) * T_nav_vehicle;
  return anchor_->T_map_vehicle * TravelledPose(way, anchor_->mounting);
}

// Of the frame, carried to the vehicle, and of the way from there. How well the way is known is
// forgotten after navigation's window: then by NAV's own covariance, which is never too sure.
Eigen::Matrix3d NavCorrection::Covariance(const NavState& nav) const {
  const Eigen::Matrix3d own = LevelCovariance(nav);
  if (!anchor_) return own;
  const Time latest = *navigation_->latest();
  const Eigen::Vector2d lever =
      Corrected(LevelPose(nav.T_map_vehicle)).Translation() - anchor_->T_map_vehicle.Translation();
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topRightCorner<2, 1>() << -lever.y(), lever.x();
  Eigen::Matrix3d covariance = J * anchor_->covariance * J.transpose();
  if (const auto way = navigation_->RelativeCovariance(anchor_->frame.time, latest)) {
    covariance += Turned(*way, anchor_->T_map_vehicle.yaw);
    // And what the prediction beyond NAV adds.
    if (const auto state = navigation_->StateAt(latest))
      covariance.topLeftCorner<2, 2>() +=
          own.topLeftCorner<2, 2>() - state->covariance.topLeftCorner<2, 2>();
  } else {
    covariance += own;
  }
  // Without a known place the graph lays the map out from its first submap.
  if (!anchor_->place_is_known) covariance.topLeftCorner<2, 2>() += own.topLeftCorner<2, 2>();
  return 0.5 * (covariance + covariance.transpose());
}

std::optional<CorrectedNavState> NavCorrection::Now() const {
  const std::optional<NavState> nav = navigation_->Predicted();
  if (!nav) return std::nullopt;
  const Pose2 T_nav_vehicle = LevelPose(nav->T_map_vehicle);
  const Pose2 T_map_vehicle = Corrected(T_nav_vehicle);
  CorrectedNavState now;
  now.state = *nav;
  if (anchor_) now.T_map_nav = T_map_vehicle * Inverse(T_nav_vehicle);
  now.state.T_map_vehicle = WithLevelPose(nav->T_map_vehicle, T_map_vehicle);
  now.state.v_map_mps.head<2>() = now.T_map_nav.Rotation() * nav->v_map_mps.head<2>();
  SetLevelCovariance(Covariance(*nav), &now.state);
  now.graph_version = graph_version_;
  now.jumps = jumps_;
  now.last_jump_m = last_jump_m_;
  now.last_jump_yaw_rad = last_jump_yaw_rad_;
  return now;
}

}  // namespace seastitch
