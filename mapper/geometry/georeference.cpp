#include "mapper/geometry/georeference.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// No echo sounder listens longer: 15 km of range.
constexpr double kMaxTravelTimeS = 20.0;
// Between knots so far apart the sonar's motion is taken as even: the sharpest roll a vehicle does
// (100 deg/s2) strays from that by a thousandth of a degree.
constexpr double kKnotS = 0.01;
constexpr int kMaxKnots = 200;
// Roundoff of the sonar's own float angles, beyond which two cones miss each other.
constexpr double kConeSlack = 1e-9;

bool IsUsable(const MbesBeam& beam) {
  return beam.twtt_s > 0.0f && beam.twtt_s <= kMaxTravelTimeS && beam.tx_delay_s >= 0.0f &&
         beam.tx_delay_s <= kMaxTravelTimeS && std::abs(beam.rx_angle_rad) < kPi / 2.0 &&
         std::abs(beam.tx_tilt_rad) < kPi / 2.0 && beam.depth_sigma_ratio >= 0.0f &&
         std::isfinite(beam.depth_sigma_ratio);
}

// The sonar's place and axes in the map, at any time of one ping.
class SonarMotion {
 public:
  struct State {
    Eigen::Vector3d p_map;
    Eigen::Vector3d forward;
    Eigen::Vector3d starboard;
  };

  static std::optional<SonarMotion> Make(Time start,
                                         double span_s,
                                         const PoseLookup& T_map_vehicle_at,
                                         const Eigen::Isometry3d& T_vehicle_sonar) {
    SonarMotion motion;
    const int steps = std::clamp(static_cast<int>(std::ceil(span_s / kKnotS)), 1, kMaxKnots);
    motion.step_s_ = std::max(span_s, 1e-6) / steps;
    for (int i = 0; i <= steps; ++i) {
      // The last knot is rounded down: the caller may have poses up to the last echo and no
      // further.
      const double at_s = std::floor(i * motion.step_s_ * 1e6) * 1e-6;
      const auto T_map_vehicle = T_map_vehicle_at(start + FromSeconds(at_s));
      if (!T_map_vehicle) return std::nullopt;
      if (i == 0) motion.first_ = *T_map_vehicle;
      motion.last_ = *T_map_vehicle;
      const Eigen::Isometry3d T_map_sonar = *T_map_vehicle * T_vehicle_sonar;
      motion.knots_.push_back(
          {T_map_sonar.translation(), T_map_sonar.linear().col(0), T_map_sonar.linear().col(1)});
    }
    return motion;
  }

  State At(double after_start_s) const {
    const double at = std::clamp(after_start_s / step_s_, 0.0, double(knots_.size() - 1));
    const std::size_t i = std::min(static_cast<std::size_t>(at), knots_.size() - 2);
    const double w = at - static_cast<double>(i);
    const State& a = knots_[i];
    const State& b = knots_[i + 1];
    return {a.p_map + w * (b.p_map - a.p_map),
            (a.forward + w * (b.forward - a.forward)).normalized(),
            (a.starboard + w * (b.starboard - a.starboard)).normalized()};
  }

  const Eigen::Isometry3d& T_map_vehicle_first() const { return first_; }
  double SpeedMps() const {
    const Eigen::Vector3d moved = last_.translation() - first_.translation();
    return moved.head<2>().norm() / (step_s_ * static_cast<double>(knots_.size() - 1));
  }

 private:
  double step_s_ = 0.0;
  std::vector<State> knots_;
  Eigen::Isometry3d first_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d last_ = Eigen::Isometry3d::Identity();
};

struct WaterColumn {
  const RayTracer& rays;
  double speed_at_transducer_mps;  // 0: that of the profile where the ray starts
};

std::optional<Sounding> Place(const MbesBeam& beam,
                              int index,
                              const SonarMotion& sonar,
                              const WaterColumn& water) {
  const SonarMotion::State tx = sonar.At(beam.tx_delay_s);
  const SonarMotion::State rx = sonar.At(double{beam.tx_delay_s} + double{beam.twtt_s});
  const auto launch = IntersectCones(tx.forward, beam.tx_tilt_rad, rx.starboard, beam.rx_angle_rad);
  if (!launch) return std::nullopt;

  const Eigen::Vector3d start = 0.5 * (tx.p_map + rx.p_map);
  const double sin_launch = launch->head<2>().norm();
  const double speed = water.speed_at_transducer_mps > 0.0 ? water.speed_at_transducer_mps
                                                           : water.rays.SpeedAt(start.z());
  const auto end =
      water.rays.Trace(start.z(), sin_launch, launch->z(), speed, 0.5 * double{beam.twtt_s});
  if (!end) return std::nullopt;

  Sounding sounding;
  sounding.beam = index;
  sounding.depth_sigma_m = static_cast<float>(double{beam.depth_sigma_ratio} * end->down_m);
  sounding.p_map = start + Eigen::Vector3d(0.0, 0.0, end->down_m);
  if (sin_launch > 0.0)
    sounding.p_map.head<2>() += launch->head<2>() * (end->horizontal_m / sin_launch);
  return sounding;
}

}  // namespace

std::optional<Eigen::Vector3d> IntersectCones(const Eigen::Vector3d& tx_axis,
                                              double tx_tilt_rad,
                                              const Eigen::Vector3d& rx_axis,
                                              double rx_angle_rad) {
  // d = a tx_axis + b rx_axis + c (tx_axis x rx_axis) with d . tx_axis = sin(tilt),
  // d . rx_axis = sin(angle), |d| = 1.
  const double along = std::sin(tx_tilt_rad);
  const double across = std::sin(rx_angle_rad);
  const double skew = tx_axis.dot(rx_axis);
  const double det = 1.0 - skew * skew;
  if (!(det > kConeSlack)) return std::nullopt;
  const double a = (along - skew * across) / det;
  const double b = (across - skew * along) / det;
  const double rest = 1.0 - (a * along + b * across);
  if (!(rest > -kConeSlack)) return std::nullopt;
  const double c = std::sqrt(std::max(rest, 0.0) / det);
  return (a * tx_axis + b * rx_axis + c * tx_axis.cross(rx_axis)).normalized();
}

std::optional<GeoreferencedPing> Georeference(const MbesPing& ping,
                                              const PoseLookup& T_map_vehicle_at,
                                              const VehicleGeometry& vehicle,
                                              const RayTracer& rays) {
  double span_s = 0.0;
  for (const MbesBeam& beam : ping.beams)
    if ((beam.flags & kBeamValid) != 0 && IsUsable(beam))
      span_s = std::max(span_s, double{beam.tx_delay_s} + double{beam.twtt_s});
  const auto sonar = SonarMotion::Make(ping.time, span_s, T_map_vehicle_at, vehicle.T_vehicle_mbes);
  if (!sonar) return std::nullopt;

  GeoreferencedPing result;
  result.time = ping.time;
  result.T_map_vehicle = sonar->T_map_vehicle_first();
  result.speed_mps = sonar->SpeedMps();
  result.beams_read = static_cast<int>(ping.beams.size());
  result.speed_from_profile = !(ping.sound_speed_mps >= RayTracer::kMinSpeedMps &&
                                ping.sound_speed_mps <= RayTracer::kMaxSpeedMps);
  const WaterColumn water{rays, result.speed_from_profile ? 0.0 : ping.sound_speed_mps};
  result.soundings.reserve(ping.beams.size());
  for (int i = 0; i < result.beams_read; ++i) {
    const MbesBeam& beam = ping.beams[static_cast<std::size_t>(i)];
    if ((beam.flags & kBeamValid) == 0) {
      ++result.beams_invalid;
      continue;
    }
    const auto sounding = IsUsable(beam) ? Place(beam, i, *sonar, water) : std::nullopt;
    if (sounding)
      result.soundings.push_back(*sounding);
    else
      ++result.beams_refused;
  }
  return result;
}

}  // namespace seastitch
