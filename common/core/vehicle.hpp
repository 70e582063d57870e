#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace seastitch {

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
  Eigen::Vector3d p_vehicle_depth_m = Eigen::Vector3d::Zero();  // pressure port
};

}  // namespace seastitch
