#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/core/sensors.hpp"
#include "mapper/navigation/nav_events.hpp"

namespace seastitch {

// Extrapolation of a state over inertial samples that still wait to be put in order: rotated by the
// gyros, at a constant velocity in vehicle axes. The error over half a second is that of the
// neglected acceleration: 2 cm at 0.2 m/s2. Accelerometers are not used, so that a faulty one has
// no influence. Pure.
class Prediction {
 public:
  // q_vehicle_imu: of the mounting. gyro_bias: imu axes.
  Prediction(const NavState& from,
             const InertialRates& rates,
             const Eigen::Quaterniond& q_vehicle_imu,
             const Eigen::Vector3d& gyro_bias_radps);

  // Later samples, in order of time.
  void CarryTo(Time t, const InertialRates& rates);
  // velocity_covariance: north and east [m2/s2], of `from`. Its correlation with the position is
  // not known: the covariance is one that no correlation exceeds.
  // turn_sigma_radps: of the rates.
  NavState state(const Eigen::Matrix2d& velocity_covariance, double turn_sigma_radps) const;

 private:
  Eigen::Vector3d Rate(const InertialRates& rates) const;

  NavState state_;
  const Eigen::Quaterniond q_vehicle_imu_;
  const Eigen::Vector3d gyro_bias_radps_;
  const Time from_;
  Eigen::Vector3d v_vehicle_mps_;
  Eigen::Vector3d rate_radps_;  // vehicle axes
};

}  // namespace seastitch
