#include "common/runtime/config/vehicle_config.hpp"

#include <cmath>

#include "common/core/pose.hpp"
#include "common/runtime/config/parameter_file.hpp"

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
  table->Add(
      "position_m",
      position_m,
      Unit::kMetre,
      Range::Any(),
      "Lever arm in vehicle axes: forward, right and down of the vehicle's reference point.");
}

void DeclareMounting(VehicleFile::Mounting* mounting, ParameterTable* table) {
  DeclarePosition(&mounting->position_m, table);
  table->Add("roll_pitch_yaw_deg",
             &mounting->roll_pitch_yaw_deg,
             Unit::kDegree,
             Range::Any(),
             "Mounting angles: the rotation from vehicle axes to sensor axes, first yaw, then "
             "pitch, then roll, each about the axis as rotated so far. Positive: right side down, "
             "bow up, clockwise from above.");
}

void DeclareArray(VehicleFile::Mounting* array, ParameterTable* table) {
  table->Add(
      "position_m",
      &array->position_m,
      Unit::kMetre,
      Range::Any(),
      "Acoustic centre of the array in sonar axes: forward, right and down of mbes.position_m.");
  table->Add("roll_pitch_yaw_deg",
             &array->roll_pitch_yaw_deg,
             Unit::kDegree,
             Range::Any(),
             "The rotation from sonar axes to array axes, in the order and with the signs of "
             "mbes.roll_pitch_yaw_deg.");
}

void DeclarePart(Eigen::Vector3d* part_m, ParameterTable* table) {
  table->Add("position_m",
             part_m,
             Unit::kMetre,
             Range::Any(),
             "Acoustic centre of the part in the array's own axes: forward, right and down of its "
             "position_m.");
}

void DeclareTransmitter(VehicleFile::Transmitter* array, ParameterTable* table) {
  DeclareArray(array, table);
  table->AddList<Eigen::Vector3d>(
      "parts",
      &array->parts_m,
      DeclarePart,
      "Parts of a transmit array that sends sectors from several places (EM 2040: port, centre, "
      "starboard), in the order of tx_array in MBES_PING. Each entry has a position_m: the part's "
      "acoustic centre in the array's own axes, forward, right and down of the array's position_m. "
      "Without parts, all sectors come from there.");
}

void DeclareHead(VehicleFile::Head* head, ParameterTable* table) {
  DeclareTransmitter(&head->transmitter, &table->AddSection("transmitter", "Its transmit array."));
  DeclareArray(&head->receiver, &table->AddSection("receiver", "Its receive array."));
}

void DeclareFixPoint(FixPoint* point, ParameterTable* table) {
  table->Add("source", &point->source, "Name of the source in POSITION_FIX messages: gps, usbl.")
      .Required();
  DeclarePosition(&point->p_vehicle_m, table);
}

void DeclareDatum(VehicleFile* file, ParameterTable* table) {
  ParameterTable& datum = table->AddSection("datum",
                                            "Map origin: x = 0, y = 0 of the map, as a WGS 84 "
                                            "position. Set it near the survey area. Its z = 0 is "
                                            "the water line.");
  datum
      .Add("latitude_deg",
           &file->datum_latitude_deg,
           Unit::kDegree,
           Range::Above(-90.0).Below(90.0),
           "Latitude, positive north.")
      .Required();
  datum
      .Add("longitude_deg",
           &file->datum_longitude_deg,
           Unit::kDegree,
           Range::Within(-180.0, 180.0),
           "Longitude, positive east.")
      .Required();
}

}  // namespace

ParameterTable TableOf(VehicleFile* file) {
  ParameterTable table;
  table.Add("name", &file->name, "Name of the vehicle, for the head of a report. Empty: none.");
  DeclareDatum(file, &table);
  DeclareMounting(&file->imu,
                  &table.AddSection("imu", "Inertial unit or INS: its measuring point."));
  DeclareMounting(&file->dvl,
                  &table.AddSection("dvl", "Doppler log: the centre of its transducers."));
  DeclareMounting(&file->mbes,
                  &table.AddSection("mbes",
                                    "Sonar: its reference point, which is its acoustic centre "
                                    "unless mbes_transmitter and mbes_receiver say otherwise."));
  DeclareTransmitter(
      &file->mbes_transmitter,
      &table.AddSection("mbes_transmitter",
                        "Transmit array with respect to the sonar. Only for a sonar whose arrays "
                        "are apart, rotated relative to each other, or mounted backwards (yaw "
                        "180)."));
  DeclareArray(&file->mbes_receiver,
               &table.AddSection("mbes_receiver", "Receive array with respect to the sonar."));
  table.AddList<VehicleFile::Head>(
      "mbes_more_heads",
      &file->more_heads,
      DeclareHead,
      "The second and further heads of a sonar with several, in the order of their numbers. Each "
      "entry has a section `transmitter` and a section `receiver`, with the keys of "
      "mbes_transmitter and mbes_receiver.");
  DeclarePosition(&file->depth_position_m,
                  &table.AddSection("depth", "Pressure sensor: its port."));
  table.AddList<FixPoint>("position_fixes",
                          &file->position_fixes,
                          DeclareFixPoint,
                          "Points of the vehicle that position fixes measure, by source: a GPS "
                          "antenna, a USBL transponder. A source without an entry measures the "
                          "vehicle's reference point.");
  return table;
}

void DeclareVehicleFile(std::filesystem::path* file, ParameterTable* table) {
  table->Add("vehicle", file, "File with the vehicle's lever arms, mounting angles and datum.")
      .DataSheet()
      .Required();
}

VehicleGeometry LoadVehicleBeside(const std::string& path, std::filesystem::path* file) {
  *file = (std::filesystem::absolute(path).parent_path() / *file).lexically_normal();
  return LoadVehicle(file->string());
}

VehicleGeometry LoadVehicle(const std::string& path) {
  VehicleFile file;
  LoadParameters(path, TableOf(&file));
  VehicleGeometry vehicle;
  vehicle.name = file.name;
  vehicle.datum.latitude_rad = Deg2Rad(file.datum_latitude_deg);
  vehicle.datum.longitude_rad = Deg2Rad(file.datum_longitude_deg);
  vehicle.T_vehicle_imu = PoseOf(file.imu);
  vehicle.T_vehicle_dvl = PoseOf(file.dvl);
  vehicle.T_vehicle_mbes = PoseOf(file.mbes);
  vehicle.T_mbes_tx = PoseOf(file.mbes_transmitter);
  vehicle.T_mbes_rx = PoseOf(file.mbes_receiver);
  vehicle.p_tx_parts_m = file.mbes_transmitter.parts_m;
  for (const VehicleFile::Head& head : file.more_heads)
    vehicle.more_heads.push_back(
        {PoseOf(head.transmitter), PoseOf(head.receiver), head.transmitter.parts_m});
  vehicle.p_vehicle_depth_m = file.depth_position_m;
  vehicle.fix_points = file.position_fixes;
  return vehicle;
}

std::string PrintConfig(const VehicleGeometry& vehicle) {
  VehicleFile file;
  file.name = vehicle.name;
  file.datum_latitude_deg = std::round(Rad2Deg(vehicle.datum.latitude_rad) * 1e9) / 1e9;
  file.datum_longitude_deg = std::round(Rad2Deg(vehicle.datum.longitude_rad) * 1e9) / 1e9;
  file.imu = MountingOf(vehicle.T_vehicle_imu);
  file.dvl = MountingOf(vehicle.T_vehicle_dvl);
  file.mbes = MountingOf(vehicle.T_vehicle_mbes);
  file.mbes_transmitter = {MountingOf(vehicle.T_mbes_tx), vehicle.p_tx_parts_m};
  file.mbes_receiver = MountingOf(vehicle.T_mbes_rx);
  for (const SonarHead& head : vehicle.more_heads)
    file.more_heads.push_back(
        {{MountingOf(head.T_mbes_tx), head.p_tx_parts_m}, MountingOf(head.T_mbes_rx)});
  file.depth_position_m = vehicle.p_vehicle_depth_m;
  file.position_fixes = vehicle.fix_points;
  return PrintWithDefaults(file, {});
}

}  // namespace seastitch
