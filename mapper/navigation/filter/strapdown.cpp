#include "mapper/navigation/filter/strapdown.hpp"

#include <GeographicLib/NormalGravity.hpp>
#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {

EarthModel::EarthModel(double latitude_rad) {
  const auto& wgs84 = GeographicLib::NormalGravity::WGS84();
  gravity_mps2 = {0.0, 0.0, wgs84.SurfaceGravity(Rad2Deg(latitude_rad))};
  rate_radps = wgs84.AngularVelocity() *
               Eigen::Vector3d(std::cos(latitude_rad), 0.0, -std::sin(latitude_rad));
}

Eigen::Quaterniond QuaternionFromRotationVector(const Eigen::Vector3d& rotation_rad) {
  const double half = 0.5 * rotation_rad.norm();
  // sin(half) / (2 half), continuous at zero.
  const double scale = half < 1e-4 ? 0.5 - half * half / 12.0 : 0.5 * std::sin(half) / half;
  Eigen::Quaterniond q;
  q.w() = std::cos(half);
  q.vec() = scale * rotation_rad;
  return q.normalized();
}

Eigen::Vector3d RotationVectorFromQuaternion(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  if (sine < 1e-9) return 2.0 * sign * q.vec();
  return (2.0 * std::atan2(sine, sign * q.w()) / sine) * sign * q.vec();
}

InertialState Integrate(const InertialState& state,
                        const InertialRates& from,
                        const InertialRates& to,
                        double dt_s,
                        const EarthModel& earth) {
  const Eigen::Vector3d& w0 = from.angular_rate_radps;
  const Eigen::Vector3d& f0 = from.specific_force_mps2;
  const Eigen::Vector3d dw = to.angular_rate_radps - w0;
  const Eigen::Vector3d df = to.specific_force_mps2 - f0;
  const double dt2 = dt_s * dt_s;

  const Eigen::Vector3d turn = (w0 + 0.5 * dw) * dt_s + w0.cross(dw) * (dt2 / 12.0);
  // Integral of (I + [turn(t)]x) f(t).
  const Eigen::Vector3d push =
      (f0 + 0.5 * df) * dt_s +
      (w0.cross(0.5 * f0 + df / 3.0) + dw.cross(f0 / 6.0 + df / 8.0)) * dt2;

  const Eigen::Vector3d earth_turn = earth.rate_radps * dt_s;
  const Eigen::Vector3d fall =
      (earth.gravity_mps2 - 2.0 * earth.rate_radps.cross(state.v_map_mps)) * dt_s;
  // The mean force, rotated by half of the Earth's rotation during the step.
  const Eigen::Vector3d push_map = state.q_map_imu * push;
  InertialState next;
  next.v_map_mps = state.v_map_mps + push_map - 0.5 * earth_turn.cross(push_map) + fall;
  next.p_map = state.p_map + 0.5 * (state.v_map_mps + next.v_map_mps) * dt_s;
  next.q_map_imu = (QuaternionFromRotationVector(-earth_turn) * state.q_map_imu *
                    QuaternionFromRotationVector(turn))
                       .normalized();
  return next;
}

}  // namespace seastitch
