#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/geo_point.hpp"

namespace seastitch {

// Poses of the transmit and the receive array of one sonar head, with respect to the sonar.
struct SonarHead {
  Eigen::Isometry3d T_mbes_tx = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_mbes_rx = Eigen::Isometry3d::Identity();
  // Acoustic centres of the parts of a transmit array that sends from several places, in its own
  // axes [m], by MbesBeam::tx_array. Empty: one, at its origin.
  std::vector<Eigen::Vector3d> p_tx_parts_m{};
};

// Point of the vehicle whose position the fixes of a source measure: an antenna or a transponder.
struct FixPoint {
  std::string source;  // PositionFix::source, such as "gps"
  Eigen::Vector3d p_vehicle_m = Eigen::Vector3d::Zero();
};

// Map origin and mounting of the sensors, as configured in vehicle.yaml. Vehicle axes: forward,
// right, down of the vehicle's reference point.
struct VehicleGeometry {
  std::string name;  // for people; empty: none
  GeoPoint datum;    // map origin
  Eigen::Isometry3d T_vehicle_imu = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_vehicle_dvl = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_vehicle_mbes = Eigen::Isometry3d::Identity();
  // Transmit and receive array with respect to the sonar. Identity: both are at its reference point
  // and have its axes.
  Eigen::Isometry3d T_mbes_tx = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_mbes_rx = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector3d> p_tx_parts_m;  // as in SonarHead
  // Heads 1, 2, ... of a sonar with several (MbesPing::head); head 0 is the one above.
  std::vector<SonarHead> more_heads;
  Eigen::Vector3d p_vehicle_depth_m = Eigen::Vector3d::Zero();  // pressure port [m]

  std::vector<FixPoint> fix_points;

  // Lever arm of a source's fixes; zero (the reference point) for a source without an entry.
  Eigen::Vector3d FixPointOf(const std::string& source) const {
    for (const FixPoint& point : fix_points)
      if (point.source == source) return point.p_vehicle_m;
    return Eigen::Vector3d::Zero();
  }
  // Arrays of a head; those of head 0 where the vehicle has no such head.
  SonarHead Head(std::uint8_t head) const {
    const std::size_t i = head;
    return i > 0 && i <= more_heads.size() ? more_heads[i - 1]
                                           : SonarHead{T_mbes_tx, T_mbes_rx, p_tx_parts_m};
  }
};

}  // namespace seastitch
