#pragma once

#include <string>
#include <vector>

#include "common/core/vehicle.hpp"
#include "common/runtime/parameters.hpp"

namespace seastitch {

// Reads config/vehicle.yaml: lever arms in metres, mounting angles in degrees, datum in degrees.
// Throws ConfigError.
VehicleGeometry LoadVehicle(const std::string& path);

// The effective geometry as vehicle.yaml, angles to 1e-9 degrees.
std::string PrintConfig(const VehicleGeometry& vehicle);

// vehicle.yaml as it stands.
struct VehicleFile {
  struct Mounting {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d roll_pitch_yaw_deg = Eigen::Vector3d::Zero();
  };
  double datum_latitude_deg = 0.0;
  double datum_longitude_deg = 0.0;
  Mounting imu;
  Mounting dvl;
  Mounting mbes;
  Mounting mbes_transmitter;
  Mounting mbes_receiver;
  struct Head {
    Mounting transmitter;
    Mounting receiver;
  };
  std::vector<Head> more_heads;
  Eigen::Vector3d depth_position_m = Eigen::Vector3d::Zero();
  std::vector<FixPoint> position_fixes;
};
ParameterTable TableOf(VehicleFile* file);

}  // namespace seastitch
