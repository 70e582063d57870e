#include "mapper/geometry/calibrated_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kMeanOverS = 20.0;
constexpr double kForgottenAfterS = 60.0;

Duration FromMilliseconds(double ms) { return FromSeconds(1e-3 * ms); }

}  // namespace

double HeaveFilter::Add(Time t, double z_m) {
  if (!last_ || ToSeconds(t - *last_) > kForgottenAfterS) {
    mean_m_ = z_m;
    heave_m_ = 0.0;
  } else if (t > *last_) {
    mean_m_ += (z_m - mean_m_) * -std::expm1(-ToSeconds(t - *last_) / kMeanOverS);
    heave_m_ = z_m - mean_m_;
  } else {
    return heave_m_;
  }
  last_ = t;
  return heave_m_;
}

PoseLookup CalibratedPoses(PoseLookup T_map_vehicle_at,
                           const SonarCalibration& calibration,
                           double heave_m) {
  return [at = std::move(T_map_vehicle_at), c = calibration, heave_m](
             Time t) -> std::optional<Eigen::Isometry3d> {
    const auto place = at(t);
    const auto attitude = at(t + FromMilliseconds(c.attitude_latency_ms));
    const auto depth = at(t + FromMilliseconds(c.depth_latency_ms));
    if (!place || !attitude || !depth) return std::nullopt;
    Eigen::Vector3d p = place->translation();
    p.z() = depth->translation().z() + 0.01 * c.heave_scale_percent * heave_m;
    const Eigen::Vector3d rpy = RpyFromRotation(attitude->linear());
    const double roll_rad = rpy.x() * (1.0 + 0.01 * c.roll_scale_percent) + c.roll_rad;
    return MakePose(p, RotationFromRpy(roll_rad, rpy.y(), rpy.z()));
  };
}

Duration LooksAhead(const SonarCalibration& calibration) {
  return FromMilliseconds(
      std::max({0.0, calibration.attitude_latency_ms, calibration.depth_latency_ms}));
}

SwathCorrection SwathCorrectionOf(const SonarCalibration& calibration) {
  return {calibration.smile_mps / SonarCalibration::kSmileSpeedMps,
          calibration.smile_by_water_mps / SonarCalibration::kSmileSpeedMps};
}

}  // namespace seastitch
