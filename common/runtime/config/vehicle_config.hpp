#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/vehicle.hpp"
#include "common/parameters/parameters.hpp"

namespace seastitch {

// Reads vehicle.yaml: lever arms in metres, mounting angles and map origin in degrees. Throws
// ConfigError.
VehicleGeometry LoadVehicle(const std::string& path);

// Declares `vehicle`, the vehicle.yaml that a configuration names.
void DeclareVehicleFile(std::filesystem::path* file, ParameterTable* table);
// Reads the vehicle.yaml that the configuration at `path` names. *file becomes absolute. Throws
// ConfigError.
VehicleGeometry LoadVehicleBeside(const std::string& path, std::filesystem::path* file);

// Text of vehicle.yaml for a geometry; angles are rounded to 1e-9 degrees.
std::string PrintConfig(const VehicleGeometry& vehicle);

// Content of vehicle.yaml with the file's keys and units.
struct VehicleFile {
  struct Mounting {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d roll_pitch_yaw_deg = Eigen::Vector3d::Zero();
  };
  std::string name;
  double datum_latitude_deg = 0.0;
  double datum_longitude_deg = 0.0;
  Mounting imu;
  Mounting dvl;
  Mounting mbes;
  struct Transmitter : Mounting {
    std::vector<Eigen::Vector3d> parts_m;
  };
  Transmitter mbes_transmitter;
  Mounting mbes_receiver;
  struct Head {
    Transmitter transmitter;
    Mounting receiver;
  };
  std::vector<Head> more_heads;
  Eigen::Vector3d depth_position_m = Eigen::Vector3d::Zero();
  std::vector<FixPoint> position_fixes;
};
ParameterTable TableOf(VehicleFile* file);

}  // namespace seastitch
