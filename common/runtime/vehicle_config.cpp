#include "common/runtime/vehicle_config.hpp"

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

Eigen::Isometry3d PoseOf(const VehicleFile::Mounting& mounting) {
  const Eigen::Vector3d& deg = mounting.roll_pitch_yaw_deg;
  return MakePose(mounting.position_m,
                  RotationFromRpy(Deg2Rad(deg.x()), Deg2Rad(deg.y()), Deg2Rad(deg.z())));
}

VehicleFile::Mounting MountingOf(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d deg = RpyFromRotation(pose.linear()) * (180.0 / kPi);
  return {pose.translation(), deg.unaryExpr([](double a) { return std::round(a * 1e9) / 1e9; })};
}

void DeclarePosition(Eigen::Vector3d* position_m, ParameterTable* table) {
  table->Add("position_m",
             position_m,
             Unit::kMetre,
             Range::Any(),
             "Lever arm: forward, right and down of the vehicle's reference point.");
}

void DeclareMounting(VehicleFile::Mounting* mounting, ParameterTable* table) {
  DeclarePosition(&mounting->position_m, table);
  table->Add("roll_pitch_yaw_deg",
             &mounting->roll_pitch_yaw_deg,
             Unit::kDegree,
             Range::Any(),
             "Mounting angles: they turn the vehicle's axes into the sensor's, yaw first, then "
             "pitch, then roll.");
}

void DeclareHead(VehicleFile::Head* head, ParameterTable* table) {
  DeclareMounting(&head->transmitter, &table->AddSection("transmitter", "Its transmit array."));
  DeclareMounting(&head->receiver, &table->AddSection("receiver", "Its receive array."));
}

void DeclareFixPoint(FixPoint* point, ParameterTable* table) {
  table->Add("source", &point->source, "As POSITION_FIX names it: gps, usbl.").Required();
  DeclarePosition(&point->p_vehicle_m, table);
}

void DeclareDatum(VehicleFile* file, ParameterTable* table) {
  ParameterTable& datum = table->AddSection("datum", "Origin of the map, WGS 84.");
  datum
      .Add("latitude_deg",
           &file->datum_latitude_deg,
           Unit::kDegree,
           Range::Above(-90.0).Below(90.0),
           "North.")
      .Required();
  datum
      .Add("longitude_deg",
           &file->datum_longitude_deg,
           Unit::kDegree,
           Range::Within(-180.0, 180.0),
           "East.")
      .Required();
}

}  // namespace

ParameterTable TableOf(VehicleFile* file) {
  ParameterTable table;
  DeclareDatum(file, &table);
  DeclareMounting(&file->imu, &table.AddSection("imu", "Inertial unit."));
  DeclareMounting(&file->dvl, &table.AddSection("dvl", "Doppler log."));
  DeclareMounting(&file->mbes, &table.AddSection("mbes", "Sonar."));
  DeclareMounting(&file->mbes_transmitter,
                  &table.AddSection(
                      "mbes_transmitter",
                      "Transmit array in the sonar's own axes, for a sonar whose arrays are apart, "
                      "turned against each other or (yaw 180) backwards."));
  DeclareMounting(&file->mbes_receiver,
                  &table.AddSection("mbes_receiver", "Receive array in the sonar's own axes."));
  table.AddList<VehicleFile::Head>(
      "mbes_more_heads",
      &file->more_heads,
      DeclareHead,
      "Further heads of a sonar with several, in order after the first. Each has a `transmitter` "
      "and a `receiver`, and these position_m and roll_pitch_yaw_deg in the sonar's own axes.");
  DeclarePosition(&file->depth_position_m, &table.AddSection("depth", "Pressure sensor."));
  table.AddList<FixPoint>("position_fixes",
                          &file->position_fixes,
                          DeclareFixPoint,
                          "What position fixes are of: antenna or transponder, by source. Fixes of "
                          "a source that is not here are of the reference point.");
  return table;
}

VehicleGeometry LoadVehicle(const std::string& path) {
  VehicleFile file;
  TableOf(&file).Load(path);
  VehicleGeometry vehicle;
  vehicle.datum_latitude_rad = Deg2Rad(file.datum_latitude_deg);
  vehicle.datum_longitude_rad = Deg2Rad(file.datum_longitude_deg);
  vehicle.T_vehicle_imu = PoseOf(file.imu);
  vehicle.T_vehicle_dvl = PoseOf(file.dvl);
  vehicle.T_vehicle_mbes = PoseOf(file.mbes);
  vehicle.T_mbes_tx = PoseOf(file.mbes_transmitter);
  vehicle.T_mbes_rx = PoseOf(file.mbes_receiver);
  for (const VehicleFile::Head& head : file.more_heads)
    vehicle.more_heads.push_back({PoseOf(head.transmitter), PoseOf(head.receiver)});
  vehicle.p_vehicle_depth_m = file.depth_position_m;
  vehicle.fix_points = file.position_fixes;
  return vehicle;
}

std::string PrintConfig(const VehicleGeometry& vehicle) {
  VehicleFile file;
  file.datum_latitude_deg = std::round(Rad2Deg(vehicle.datum_latitude_rad) * 1e9) / 1e9;
  file.datum_longitude_deg = std::round(Rad2Deg(vehicle.datum_longitude_rad) * 1e9) / 1e9;
  file.imu = MountingOf(vehicle.T_vehicle_imu);
  file.dvl = MountingOf(vehicle.T_vehicle_dvl);
  file.mbes = MountingOf(vehicle.T_vehicle_mbes);
  file.mbes_transmitter = MountingOf(vehicle.T_mbes_tx);
  file.mbes_receiver = MountingOf(vehicle.T_mbes_rx);
  for (const SonarHead& head : vehicle.more_heads)
    file.more_heads.push_back({MountingOf(head.T_mbes_tx), MountingOf(head.T_mbes_rx)});
  file.depth_position_m = vehicle.p_vehicle_depth_m;
  file.position_fixes = vehicle.fix_points;
  return PrintWithDefaults(file, {});
}

}  // namespace seastitch
