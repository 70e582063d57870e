#include "mapper/nav_correction.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {
namespace {

// Limit of a fix's normalised innovation (chi-squared, two degrees of freedom), exceeded by one in
// a thousand. Beyond it the innovation covariance is scaled up to the limit: the further off the
// fix, the less it moves the anchor. The graph has its own robust weighting.
constexpr double kSurprise = 13.8;
// Number of consecutive fixes beyond the limit that agree with each other: then they are used, and
// the anchor is taken as wrong.
constexpr int kOverrulingFixes = 3;
// Sigma [m] from which a position counts as unknown: then a single fix beyond the limit is used.
constexpr double kVagueM = 100.0;
constexpr Eigen::Index kLevelAxes[3] = {0, 1, 5};  // x, y, yaw in the covariance of NAV

Eigen::Matrix3d LevelCovariance(const NavState& nav) {
  Eigen::Matrix3d level;
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index c = 0; c < 3; ++c) level(r, c) = nav.covariance(kLevelAxes[r], kLevelAxes[c]);
  return level;
}

double LevelSigma(const Eigen::Matrix3d& level) {
  return std::sqrt(level.topLeftCorner<2, 2>().trace());
}

// Replaces the covariance of x, y, yaw. That of depth, roll and pitch remains; correlations between
// both groups are in NAV's frame and set to zero.
void SetLevelCovariance(const Eigen::Matrix3d& level, NavState* nav) {
  const Matrix6d before = nav->covariance;
  nav->covariance.setZero();
  nav->covariance.block<3, 3>(2, 2) = before.block<3, 3>(2, 2);
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index c = 0; c < 3; ++c)
      nav->covariance(kLevelAxes[r], kLevelAxes[c]) = level(r, c);
}

Eigen::Matrix3d Symmetric(const Eigen::Matrix3d& m) { return 0.5 * (m + m.transpose()); }

bool IsSame(const MapFix& a, const MapFix& b) {
  return a.time == b.time && a.north_east_m == b.north_east_m;
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

void NavCorrection::Given(const std::vector<MapFix>& fixes, SubmapId with) {
  for (const MapFix& fix : fixes) {
    given_.push_back({fix, with});
    std::erase_if(waiting_, [&fix](const MapFix& other) { return IsSame(fix, other); });
  }
}

void NavCorrection::Take(const PoseGraph& solution) {
  const auto newest = std::find_if(
      solution.vertices.rbegin(), solution.vertices.rend(), [this](const SolvedVertex& vertex) {
        return frames_.contains(vertex.id);
      });
  if (newest == solution.vertices.rend()) return;
  const std::optional<CorrectedNavState> before = Now();
  const MountingErrors mounting = solution.MountingOf(0);  // on the vehicle there is one dive
  solved_ = Anchor{frames_.at(newest->id),
                   VehiclePose(newest->T_map_level, mounting),
                   newest->covariance,
                   mounting};
  // Without a known start position the graph is relative to its first submap: NAV's covariance is
  // added.
  const bool place_is_known = placed_ && *placed_ <= solution.graph_version;
  if (const auto nav = navigation_->StateAt(*navigation_->latest()); nav && !place_is_known)
    solved_->covariance.topLeftCorner<2, 2>() += nav->covariance.topLeftCorner<2, 2>();
  graph_version_ = solution.graph_version;
  frames_.erase(frames_.begin(), frames_.find(newest->id));
  std::erase_if(given_, [&newest](const GivenFix& given) { return given.with <= newest->id; });
  MoveByAllFixes();
  CountJump(before);
}

// --- fixes ---------------------------------------------------------------------------------------

void NavCorrection::TakeFixes() {
  std::vector<MapFix> waiting = navigation_->WaitingFixes();
  std::vector<MapFix> added;
  for (const MapFix& fix : waiting)
    if (std::none_of(waiting_.begin(), waiting_.end(), [&fix](const MapFix& other) {
          return IsSame(fix, other);
        }))
      added.push_back(fix);
  waiting_ = std::move(waiting);
  if (added.empty()) return;
  const std::optional<CorrectedNavState> before = Now();
  if (anchor_ && added.front().time <= anchor_->frame.time)
    MoveByAllFixes();
  else
    for (const MapFix& fix : added) MoveBy(fix);
  CountJump(before);
}

void NavCorrection::MoveByAllFixes() {
  std::vector<MapFix> fixes = waiting_;
  for (const GivenFix& given : given_) fixes.push_back(given.fix);
  std::stable_sort(
      fixes.begin(), fixes.end(), [](const MapFix& a, const MapFix& b) { return a.time < b.time; });
  anchor_ = solved_;
  for (const MapFix& fix : fixes) MoveBy(fix);
}

// Corrects the anchor by a fix. For a fix after the anchor, the anchor is first carried to the
// fix's time. For an earlier fix, the dead-reckoned pose difference and its covariance lie between.
void NavCorrection::MoveBy(const MapFix& fix) {
  const std::optional<NavState> nav = navigation_->StateAt(fix.time);
  if (!nav) return;
  const Frame at_fix{fix.time, LevelPose(nav->T_map_vehicle)};
  if (!anchor_) anchor_ = Anchor{at_fix, at_fix.dead_reckoned, LevelCovariance(*nav), {}};
  if (fix.time > anchor_->frame.time) CarryAnchorTo(fix.time, *nav);
  const Eigen::Vector2d lever =
      Corrected(at_fix).Translation() - anchor_->T_map_vehicle.Translation();
  Eigen::Matrix<double, 2, 3> H;
  H << Eigen::Matrix2d::Identity(), Eigen::Vector2d(-lever.y(), lever.x());
  Eigen::Matrix2d R = fix.covariance_m2;
  if (fix.time < anchor_->frame.time) {
    const auto way = navigation_->RelativeCovariance(anchor_->frame.time, fix.time);
    if (!way) return;
    R += Turned(*way, anchor_->T_map_vehicle.yaw).topLeftCorner<2, 2>();
  }
  Update(H, fix.north_east_m - anchor_->T_map_vehicle.Translation() - lever, R);
}

// off = H * (error of the anchor's x, y, yaw) + noise with covariance R.
void NavCorrection::Update(const Eigen::Matrix<double, 2, 3>& H,
                           const Eigen::Vector2d& off,
                           const Eigen::Matrix2d& R) {
  Eigen::Matrix3d& P = anchor_->covariance;
  Eigen::Matrix2d S = H * P * H.transpose() + R;
  double surprise = off.dot(S.inverse() * off) / kSurprise;
  if (IsOverruled(surprise > 1.0, off, R)) {
    P.topLeftCorner<2, 2>() += off * off.transpose();
    S += off * off.transpose();
    surprise = 1.0;
  }
  S *= std::max(1.0, surprise);
  const Eigen::Matrix<double, 3, 2> K = P * H.transpose() * S.inverse();
  const Eigen::Vector3d by = K * off;
  Pose2& pose = anchor_->T_map_vehicle;
  pose = {pose.x + by.x(), pose.y + by.y(), WrapAngle(pose.yaw + by.z())};
  P = Symmetric(P - K * S * K.transpose());
}

bool NavCorrection::IsOverruled(bool surprising,
                                const Eigen::Vector2d& off,
                                const Eigen::Matrix2d& R) {
  Surprises& s = anchor_->surprises;
  const bool agrees = s.in_a_row > 0 && (off - s.off).squaredNorm() < 2.0 * kSurprise * R.trace();
  s = surprising ? Surprises{agrees ? s.in_a_row + 1 : 1, off} : Surprises{};
  const bool is_vague = anchor_->covariance.topLeftCorner<2, 2>().trace() > kVagueM * kVagueM;
  if (s.in_a_row < (is_vague ? 1 : kOverrulingFixes)) return false;
  s = {};
  return true;
}

void NavCorrection::CarryAnchorTo(Time t, const NavState& nav) {
  const Frame frame{t, LevelPose(nav.T_map_vehicle)};
  const Eigen::Matrix3d covariance = CovarianceAt(t, nav);
  anchor_->T_map_vehicle = Corrected(frame);
  anchor_->covariance = covariance;
  anchor_->frame = frame;
}

// --- the vehicle ---------------------------------------------------------------------------------

// Relative pose by dead reckoning with the smoother's corrections of the past (hindsight):
// corrections before the anchor move NAV, but not the corrected pose.
Pose2 NavCorrection::Way(const Frame& from, const Frame& to) const {
  if (to.time < from.time) return Inverse(Way(to, from));
  const Pose2 T_anchored_map = navigation_->Hindsight(from.time, to.time).value_or(Pose2{});
  return Inverse(from.dead_reckoned) * T_anchored_map * to.dead_reckoned;
}

Pose2 NavCorrection::Corrected(const Frame& nav) const {
  if (!anchor_) return nav.dead_reckoned;
  return anchor_->T_map_vehicle * TravelledPose(Way(anchor_->frame, nav), anchor_->mounting);
}

// Covariance of the anchor, carried to the vehicle, plus that of the way since. Older than
// navigation's window, the latter is replaced by NAV's own covariance, which is not too small.
Eigen::Matrix3d NavCorrection::CovarianceAt(Time t, const NavState& nav) const {
  const Eigen::Matrix3d own = LevelCovariance(nav);
  if (!anchor_) return own;
  const Eigen::Vector2d lever = Corrected({t, LevelPose(nav.T_map_vehicle)}).Translation() -
                                anchor_->T_map_vehicle.Translation();
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topRightCorner<2, 1>() << -lever.y(), lever.x();
  const auto way = navigation_->RelativeCovariance(anchor_->frame.time, t);
  return Symmetric(J * anchor_->covariance * J.transpose() +
                   (way ? Turned(*way, anchor_->T_map_vehicle.yaw) : own));
}

// Adds to sigma as much as the prediction adds to NAV's sigma, whatever the correlations: the sigma
// here may be very different from NAV's.
Eigen::Matrix3d NavCorrection::Covariance(const NavState& predicted) const {
  const Time latest = *navigation_->latest();
  Eigen::Matrix3d covariance = CovarianceAt(latest, predicted);
  const std::optional<NavState> nav = navigation_->StateAt(latest);
  if (!anchor_ || !nav) return covariance;
  const double more_m = LevelSigma(LevelCovariance(predicted)) - LevelSigma(LevelCovariance(*nav));
  const double sigma_m = LevelSigma(covariance);
  if (!(more_m > 0.0 && sigma_m > 0.0)) return covariance;
  covariance.topLeftCorner<2, 2>() *= 1.0 + more_m / sigma_m;
  covariance.topLeftCorner<2, 2>().diagonal().array() += 0.5 * more_m * (more_m + sigma_m);
  return covariance;
}

void NavCorrection::CountJump(const std::optional<CorrectedNavState>& before) {
  const std::optional<CorrectedNavState> after = Now();
  if (!before || !after) return;
  const Pose2 a = LevelPose(before->state.T_map_vehicle);
  const Pose2 b = LevelPose(after->state.T_map_vehicle);
  ++jumps_;
  last_jump_m_ = (b.Translation() - a.Translation()).norm();
  last_jump_yaw_rad_ = WrapAngle(b.yaw - a.yaw);
}

std::optional<CorrectedNavState> NavCorrection::Now() const {
  const std::optional<NavState> nav = navigation_->Predicted();
  if (!nav) return std::nullopt;
  const Pose2 T_nav_vehicle = LevelPose(nav->T_map_vehicle);
  const Pose2 T_map_vehicle = Corrected({*navigation_->latest(), T_nav_vehicle});
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
