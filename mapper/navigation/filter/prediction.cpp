#include "mapper/navigation/filter/prediction.hpp"

#include <cmath>

namespace seastitch {

Prediction::Prediction(const NavState& from,
                       const InertialRates& rates,
                       const Eigen::Quaterniond& q_vehicle_imu,
                       const Eigen::Vector3d& gyro_bias_radps)
    : state_(from),
      q_vehicle_imu_(q_vehicle_imu),
      gyro_bias_radps_(gyro_bias_radps),
      from_(from.time),
      v_vehicle_mps_(from.T_map_vehicle.linear().transpose() * from.v_map_mps),
      rate_radps_(Rate(rates)) {}

Eigen::Vector3d Prediction::Rate(const InertialRates& rates) const {
  return q_vehicle_imu_ * (rates.angular_rate_radps - gyro_bias_radps_);
}

void Prediction::CarryTo(Time t, const InertialRates& rates) {
  const double dt_s = ToSeconds(t - state_.time);
  if (!(dt_s > 0.0)) return;
  const Eigen::Vector3d rate = Rate(rates);
  const Eigen::Quaterniond turn = QuaternionFromRotationVector(0.5 * dt_s * (rate_radps_ + rate));
  const Eigen::Quaterniond q =
      (Eigen::Quaterniond(state_.T_map_vehicle.linear()) * turn).normalized();
  const Eigen::Vector3d v = q * v_vehicle_mps_;
  state_.T_map_vehicle.translation() += 0.5 * dt_s * (state_.v_map_mps + v);
  state_.T_map_vehicle.linear() = q.toRotationMatrix();
  state_.v_map_mps = v;
  state_.time = t;
  rate_radps_ = rate;
}

// Bounds the covariance of p + dt v: (1 + a) Cov(p) + (1 + 1 / a) dt^2 Cov(v), for every a > 0.
NavState Prediction::state(const Eigen::Matrix2d& velocity_covariance,
                           double turn_sigma_radps) const {
  NavState state = state_;
  const double dt_s = ToSeconds(state.time - from_);
  const double turned_rad = dt_s * turn_sigma_radps;
  state.covariance(5, 5) += turned_rad * turned_rad;
  Eigen::Matrix2d P = state.covariance.topLeftCorner<2, 2>();
  const double moved = dt_s * std::sqrt(velocity_covariance.trace());
  if (!(moved > 0.0) || !(P.trace() > 0.0)) return state;
  const double a = moved / std::sqrt(P.trace());
  P = (1.0 + a) * P + (1.0 + 1.0 / a) * dt_s * dt_s * velocity_covariance;
  state.covariance.topLeftCorner<2, 2>() = P;
  return state;
}

}  // namespace seastitch
