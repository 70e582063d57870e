#include "products/report/dive_report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kMaxGapS = 1.0;

std::optional<Pose2> PoseAt(const std::vector<TrackState>& track, Time t) {
  const auto after = std::lower_bound(
      track.begin(), track.end(), t, [](const TrackState& s, Time at) { return s.time < at; });
  if (after == track.end()) return std::nullopt;
  const Pose2 b{after->p_map.x(), after->p_map.y(), after->rpy_rad.z()};
  if (after->time == t) return b;
  if (after == track.begin()) return std::nullopt;
  const TrackState& before = *std::prev(after);
  const double step_s = ToSeconds(after->time - before.time);
  if (step_s > kMaxGapS) return std::nullopt;
  const double w = ToSeconds(t - before.time) / step_s;
  const Eigen::Vector2d a = before.p_map.head<2>();
  const Eigen::Vector2d p = a + w * (b.Translation() - a);
  return Pose2{p.x(), p.y(), before.rpy_rad.z() + w * WrapAngle(b.yaw - before.rpy_rad.z())};
}

}  // namespace

std::optional<NavigationDifference> CompareNavigations(const std::vector<TrackState>& track,
                                                       const std::vector<TrackState>& second,
                                                       const std::string& source) {
  NavigationDifference difference{source};
  std::optional<Eigen::Vector2d> start_m;
  Time first;
  double squares_m2 = 0.0, heading_rad = 0.0;
  for (const TrackState& state : track) {
    const std::optional<Pose2> other = PoseAt(second, state.time);
    if (!other) continue;
    const Eigen::Vector2d off_m = other->Translation() - state.p_map.head<2>();
    if (!start_m) {
      start_m = off_m;
      first = state.time;
    }
    const double moved_m = (off_m - *start_m).norm();
    squares_m2 += moved_m * moved_m;
    difference.max_m = std::max(difference.max_m, moved_m);
    heading_rad += WrapAngle(other->yaw - state.rpy_rad.z());
    difference.duration_s = ToSeconds(state.time - first);
    ++difference.states;
  }
  if (difference.states == 0) return std::nullopt;
  const auto n = static_cast<double>(difference.states);
  difference.rms_m = std::sqrt(squares_m2 / n);
  difference.heading_mean_deg = Rad2Deg(heading_rad / n);
  return difference;
}

}  // namespace seastitch
