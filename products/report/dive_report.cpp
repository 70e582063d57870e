#include "products/report/dive_report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/core/pose.hpp"
#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

constexpr double kMaxGapS = 1.0;

std::optional<Pose2> PoseAt(const std::vector<TrackState>& track, Time t) {
  const auto around = AroundOf(track, t, kMaxGapS);
  if (!around) return std::nullopt;
  const auto level = [](const TrackState& s) {
    return Pose2{s.p_map.x(), s.p_map.y(), s.rpy_rad.z()};
  };
  return PoseBetween(level(around->before), level(around->after), around->share);
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
