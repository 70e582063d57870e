#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace seastitch {

// Transmit and receive array of one head, in the axes of the sonar.
struct SonarHead {
  Eigen::Isometry3d T_mbes_tx = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_mbes_rx = Eigen::Isometry3d::Identity();
};

// What the position fixes of a source are of: an antenna or a transponder.
struct FixPoint {
  std::string source;  // as POSITION_FIX names it, such as "gps"
  Eigen::Vector3d p_vehicle_m = Eigen::Vector3d::Zero();
};

// Where the map's origin lies and where the sensors sit. Vehicle axes: forward, right, down.
struct VehicleGeometry {
  double datum_latitude_rad = 0.0;  // WGS 84, origin of the map frame
  double datum_longitude_rad = 0.0;
  Eigen::Isometry3d T_vehicle_imu = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_vehicle_dvl = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_vehicle_mbes = Eigen::Isometry3d::Identity();
  // Transmit and receive array within the sonar, where they are not at one place or not square.
  Eigen::Isometry3d T_mbes_tx = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_mbes_rx = Eigen::Isometry3d::Identity();
  // Of a sonar with several heads those after the first, by MbesPing::head from 1 on.
  std::vector<SonarHead> more_heads;
  Eigen::Vector3d p_vehicle_depth_m = Eigen::Vector3d::Zero();  // pressure port

  std::vector<FixPoint> fix_points;

  // The reference point, where none is named for the source.
  Eigen::Vector3d FixPointOf(const std::string& source) const {
    for (const FixPoint& point : fix_points)
      if (point.source == source) return point.p_vehicle_m;
    return Eigen::Vector3d::Zero();
  }
  // The first, where the vehicle has no such head.
  SonarHead Head(std::uint8_t head) const {
    const std::size_t i = head;
    return i > 0 && i <= more_heads.size() ? more_heads[i - 1] : SonarHead{T_mbes_tx, T_mbes_rx};
  }
};

}  // namespace seastitch
