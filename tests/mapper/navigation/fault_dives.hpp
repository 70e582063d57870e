#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch::test {

// Truth of the vehicle frame, in the map.
struct TruthSample {
  Time time;
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
};

// A recorded dive with its truth. Every inertial sample carries an attitude; all sensors are in
// order of time.
struct Dive {
  std::string name;
  NavigationParams params;  // the data sheets of its sensors
  VehicleGeometry vehicle;
  std::vector<ImuSample> imu;
  std::vector<DvlSample> dvl;
  std::vector<DepthSample> depth;
  std::vector<PositionFix> fixes;
  std::vector<TruthSample> truth;  // once a second
  double imu_hz = 100.0;
};

double DurationS(const Dive& dive);
double DistanceM(const Dive& dive);

// Legs of 50 s with turns of up to 28 deg/s; sensors err as the default params say. DVL at
// 5 Hz, depth at 10 Hz.
Dive SimulatedDive(std::uint32_t seed, double duration_s = 600.0, double imu_hz = 100.0);

// One of the real A-KIT runs with its clocks put right (docs/navigation.md). Nothing where the
// folder has no such run. Throws std::runtime_error on a file that cannot be read.
std::optional<Dive> AkitDive(const std::filesystem::path& folder, const std::string& run);

}  // namespace seastitch::test
