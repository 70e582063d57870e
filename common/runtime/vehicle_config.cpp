#include "common/runtime/vehicle_config.hpp"

#include <cmath>
#include <vector>

#include "common/core/pose.hpp"
#include "common/runtime/config.hpp"

namespace seastitch {
namespace {

Eigen::Vector3d ReadVector(ConfigMap* map, const std::string& key) {
  std::vector<double> v{0.0, 0.0, 0.0};
  map->Read(key, &v);
  if (v.size() != 3) map->Check(key + " has " + std::to_string(v.size()) + " numbers, expected 3");
  const Eigen::Vector3d vector(v[0], v[1], v[2]);
  if (!vector.allFinite()) map->Check(key + " is not finite");
  return vector;
}

Eigen::Isometry3d ReadMounting(ConfigMap* root, const std::string& sensor) {
  ConfigMap map = root->Child(sensor);
  const Eigen::Vector3d p = ReadVector(&map, "position_m");
  const Eigen::Vector3d rpy_deg = ReadVector(&map, "roll_pitch_yaw_deg");
  map.Finish();
  return MakePose(
      p, RotationFromRpy(Deg2Rad(rpy_deg.x()), Deg2Rad(rpy_deg.y()), Deg2Rad(rpy_deg.z())));
}

}  // namespace

VehicleGeometry LoadVehicle(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  VehicleGeometry vehicle;

  ConfigMap datum = root.Child("datum");
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  datum.Require("latitude_deg", &latitude_deg);
  datum.Require("longitude_deg", &longitude_deg);
  if (!(std::abs(latitude_deg) < 90.0)) datum.Check("latitude_deg must lie within -90 and 90");
  if (!(std::abs(longitude_deg) <= 180.0))
    datum.Check("longitude_deg must lie within -180 and 180");
  datum.Finish();
  vehicle.datum_latitude_rad = Deg2Rad(latitude_deg);
  vehicle.datum_longitude_rad = Deg2Rad(longitude_deg);

  vehicle.T_vehicle_imu = ReadMounting(&root, "imu");
  vehicle.T_vehicle_dvl = ReadMounting(&root, "dvl");
  vehicle.T_vehicle_mbes = ReadMounting(&root, "mbes");
  vehicle.T_mbes_tx = ReadMounting(&root, "mbes_transmitter");
  vehicle.T_mbes_rx = ReadMounting(&root, "mbes_receiver");
  ConfigMap depth = root.Child("depth");
  vehicle.p_vehicle_depth_m = ReadVector(&depth, "position_m");
  depth.Finish();
  root.Finish();
  return vehicle;
}

}  // namespace seastitch
