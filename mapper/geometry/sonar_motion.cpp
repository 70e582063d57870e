#include "mapper/geometry/sonar_motion.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// Time between knots [s]; between them the sonar's motion is interpolated. At the strongest roll
// acceleration of a vehicle (100 deg/s2) the error is a thousandth of a degree.
constexpr double kKnotS = 0.01;
constexpr int kMaxKnots = static_cast<int>(kMaxTravelTime_s / kKnotS);

// Time from the first pulse to the last echo [s].
double ListeningTime(const MbesPing& ping) {
  double span_s = 0.0;
  for (const MbesBeam& beam : ping.beams)
    if ((beam.flags & kBeamValid) != 0 && IsUsable(beam))
      span_s = std::max(span_s, double{beam.tx_delay_s} + double{beam.twtt_s});
  return span_s;
}

}  // namespace

std::optional<SonarMotion> SonarMotion::Of(const MbesPing& ping,
                                           const PoseLookup& T_map_vehicle_at,
                                           const VehicleGeometry& vehicle) {
  const SonarHead head = vehicle.Head(ping.head);
  const Eigen::Isometry3d T_vehicle_tx = vehicle.T_vehicle_mbes * head.T_mbes_tx;
  const Eigen::Isometry3d T_vehicle_rx = vehicle.T_vehicle_mbes * head.T_mbes_rx;
  const double span_s = ListeningTime(ping);
  SonarMotion motion;
  motion.parts_.resize(head.p_tx_parts_m.size());
  const int steps = std::clamp(static_cast<int>(std::ceil(span_s / kKnotS)), 1, kMaxKnots);
  motion.step_s_ = std::max(span_s, 1e-6) / steps;
  motion.knots_.reserve(static_cast<std::size_t>(steps) + 1);
  for (int i = 0; i <= steps; ++i) {
    // The last knot is rounded down: the caller may not have poses after the last echo.
    const double at_s = std::floor(i * motion.step_s_ * 1e6) * 1e-6;
    const auto T_map_vehicle = T_map_vehicle_at(ping.time + FromSeconds(at_s));
    if (!T_map_vehicle) return std::nullopt;
    if (i == 0) motion.first_ = *T_map_vehicle;
    const Eigen::Isometry3d T_map_tx = *T_map_vehicle * T_vehicle_tx;
    const Eigen::Isometry3d T_map_rx = *T_map_vehicle * T_vehicle_rx;
    motion.knots_.push_back({{T_map_tx.translation(), T_map_tx.linear().col(0)},
                             {T_map_rx.translation(), T_map_rx.linear().col(1)}});
    for (std::size_t part = 0; part < motion.parts_.size(); ++part)
      motion.parts_[part].push_back(T_map_tx.linear() * head.p_tx_parts_m[part]);
  }
  return motion;
}

ArrayState SonarMotion::TxPartAt(double after_start_s, std::size_t part) const {
  ArrayState tx = TxAt(after_start_s);
  if (parts_.empty()) return tx;
  const std::vector<Eigen::Vector3d>& track = parts_[part < parts_.size() ? part : 0];
  const double at = KnotsSince(after_start_s);
  const std::size_t i = KnotAt(at);
  tx.p_map += track[i] + (at - static_cast<double>(i)) * (track[i + 1] - track[i]);
  return tx;
}

}  // namespace seastitch
