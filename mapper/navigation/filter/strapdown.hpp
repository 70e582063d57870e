#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace seastitch {

// Angular rate and specific force, imu axes; biases removed, unless a function says otherwise.
struct InertialRates {
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.angular_rate_radps, self.specific_force_mps2);
  }
};

// State of the inertial unit itself, in the map (North-East-Down, fixed to the Earth).
struct InertialState {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_map_imu = Eigen::Quaterniond::Identity();

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.p_map, self.v_map_mps, self.q_map_imu);
  }
};

// Gravity and rotation of the Earth at the datum, in the map.
struct EarthModel {
  explicit EarthModel(double latitude_rad);
  Eigen::Vector3d gravity_mps2;  // WGS 84 normal gravity (Somigliana) at sea level
  Eigen::Vector3d rate_radps;
};

// exp of a rotation vector.
Eigen::Quaterniond QuaternionFromRotationVector(const Eigen::Vector3d& rotation_rad);
// Its inverse, the short way round.
Eigen::Vector3d RotationVectorFromQuaternion(const Eigen::Quaterniond& q);

// Integrates the state over dt_s, with rates that change linearly from `from` to `to`. The rotation
// vector includes the coning term, the velocity step the rotation and sculling terms of such rates,
// to second order (Savage, J. Guidance 21(1) and 21(2), 1998). The Earth's rotation and Coriolis
// acceleration are included. There is no transport rate, since the map is fixed to the Earth.
InertialState Integrate(const InertialState& state,
                        const InertialRates& from,
                        const InertialRates& to,
                        double dt_s,
                        const EarthModel& earth);

}  // namespace seastitch
