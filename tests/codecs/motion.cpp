#include "tests/codecs/motion.hpp"

#include <algorithm>
#include <map>

#include "common/core/pose.hpp"

namespace seastitch {

Motion::Motion(const std::vector<NavigationRecord>& samples, const std::string& source) {
  std::map<Time, Knot> knots;
  for (const NavigationRecord& s : samples)
    if (s.source.starts_with(source) && s.attitude && s.heave_m)
      knots.emplace(
          s.time,
          Knot{s.time, RpyFromRotation(s.attitude->q_ned_imu.toRotationMatrix()), *s.heave_m});
  for (auto& [time, knot] : knots) {
    if (!knots_.empty())
      knot.rpy.z() = knots_.back().rpy.z() + WrapAngle(knot.rpy.z() - knots_.back().rpy.z());
    knots_.push_back(knot);
  }
}

bool Motion::Covers(Time from, Time to) const {
  return !knots_.empty() && from >= knots_.front().time && to <= knots_.back().time;
}

Eigen::Matrix3d Motion::RotationAt(Time t, double heading_rad) const {
  const Eigen::Vector3d rpy = RpyAt(t);
  return RotationFromRpy(rpy.x(), rpy.y(), rpy.z() - heading_rad);
}

Motion::Knot Motion::At(Time t) const {
  const auto next = std::upper_bound(
      knots_.begin(), knots_.end(), t, [](Time at, const Knot& k) { return at < k.time; });
  if (next == knots_.begin()) return knots_.front();
  if (next == knots_.end()) return knots_.back();
  const Knot& a = *std::prev(next);
  const double w = ToSeconds(t - a.time) / ToSeconds(next->time - a.time);
  return {t, a.rpy + w * (next->rpy - a.rpy), a.heave_m + w * (next->heave_m - a.heave_m)};
}

}  // namespace seastitch
