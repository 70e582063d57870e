#include "mapper/geometry/calibrated_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/time_series.hpp"

namespace seastitch {
namespace {

constexpr double kHalfWindowS = 10.0;

Duration FromMilliseconds(double ms) { return FromSeconds(1e-3 * ms); }

}  // namespace

double HeaveAt(const std::vector<DepthAt>& track, Time t) {
  const Duration half = FromSeconds(kHalfWindowS);
  const auto begin = FirstFrom(track, t - half);
  double n = 0.0, s = 0.0, z = 0.0, ss = 0.0, sz = 0.0, zero_m = 0.0, nearest_s = kHalfWindowS;
  for (auto d = begin; d != track.end() && d->time <= t + half; ++d) {
    const double at_s = ToSeconds(d->time - t);
    n += 1.0;
    s += at_s;
    z += d->z_m;
    ss += at_s * at_s;
    sz += at_s * d->z_m;
    if (std::abs(at_s) >= nearest_s) continue;
    nearest_s = std::abs(at_s);
    zero_m = d->z_m;
  }
  const double det = n * ss - s * s;
  if (n < 3.0 || !(det > 0.0)) return 0.0;
  return zero_m - (ss * z - s * sz) / det;
}

double HeaveAt(const PoseLookup& T_map_vehicle_at, Time t) {
  constexpr double kStepS = 0.1;
  constexpr int kSteps = static_cast<int>(kHalfWindowS / kStepS);
  std::vector<DepthAt> track;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const Time at = t + FromSeconds(kStepS * i);
    if (const auto pose = T_map_vehicle_at(at)) track.push_back({at, pose->translation().z()});
  }
  return HeaveAt(track, t);
}

PoseLookup CalibratedPoses(PoseLookup T_map_vehicle_at,
                           const SonarCalibration& calibration,
                           std::uint8_t head,
                           double heave_m) {
  return [at = std::move(T_map_vehicle_at), c = calibration, head, heave_m](
             Time t) -> std::optional<Eigen::Isometry3d> {
    const auto place = at(t);
    const auto attitude = at(t + FromMilliseconds(c.attitude_latency_ms));
    const auto depth = at(t + FromMilliseconds(c.depth_latency_ms));
    if (!place || !attitude || !depth) return std::nullopt;
    Eigen::Vector3d p = place->translation();
    p.z() = depth->translation().z() + 0.01 * c.heave_scale_percent * heave_m;
    const Eigen::Vector3d rpy = RpyFromRotation(attitude->linear());
    const double roll_rad = rpy.x() * (1.0 + 0.01 * c.roll_scale_percent) +
                            (head == 1 ? c.second_head_roll_rad : c.roll_rad);
    return MakePose(p, RotationFromRpy(roll_rad, rpy.y(), rpy.z()));
  };
}

Duration LooksAhead(const SonarCalibration& calibration) {
  const double for_heave_ms = calibration.heave_scale_percent == 0.0 ? 0.0 : 1e3 * kHalfWindowS;
  return FromMilliseconds(
      std::max({for_heave_ms, calibration.attitude_latency_ms, calibration.depth_latency_ms}));
}

SwathCorrection SwathCorrectionOf(const SonarCalibration& calibration) {
  return {calibration.smile_mps / SonarCalibration::kSmileSpeedMps,
          calibration.smile_by_water_mps / SonarCalibration::kSmileSpeedMps};
}

}  // namespace seastitch
