#pragma once

#include <string>

#include "bench/log.hpp"
#include "bench/simulator.hpp"
#include "common/core/pose.hpp"
#include "tests/support/paths.hpp"

namespace seastitch::bench {

// Off in every way, so that a lever arm or an angle forgotten is seen.
inline VehicleGeometry CrookedVehicle() {
  VehicleGeometry vehicle;
  vehicle.datum.latitude_rad = Deg2Rad(43.0);
  vehicle.datum.longitude_rad = Deg2Rad(-70.0);
  vehicle.T_vehicle_imu =
      MakePose({0.5, 0.1, -0.2}, RotationFromRpy(Deg2Rad(1.0), Deg2Rad(-2.0), Deg2Rad(3.0)));
  vehicle.T_vehicle_dvl =
      MakePose({-0.6, 0.05, 0.15}, RotationFromRpy(Deg2Rad(-1.0), Deg2Rad(1.5), Deg2Rad(45.0)));
  vehicle.T_vehicle_mbes =
      MakePose({0.45, -0.1, 0.2}, RotationFromRpy(Deg2Rad(0.8), Deg2Rad(-1.2), Deg2Rad(0.5)));
  vehicle.p_vehicle_depth_m = {-0.1, 0.05, 0.3};
  return vehicle;
}

inline DriverConfigs ShippedDrivers() { return LoadDriverConfigs(SourceDir() / "config"); }

// One short line over relief, without any error.
inline SurveyConfig ShortSurvey() {
  SurveyConfig config;
  config.terrain.depth_m = 20.0;
  config.terrain.relief.rms_m = 0.5;
  config.terrain.relief.longest_m = 40.0;
  config.plan.lines = 1;
  config.plan.line_length_m = 20.0;
  config.plan.crosslines = 0;
  config.plan.heading_deg = 30.0;
  config.errors = SensorErrors::OfClass("ideal");
  config.mbes.beams = 65;
  config.mbes.range_noise_m = 0.0;
  config.mbes.range_noise_ratio = 0.0;
  config.mbes.angle_noise_deg = 0.0;
  config.mbes.outlier_rate = 0.0;
  config.mbes.drop_rate = 0.0;
  config.mbes.misdetection_rate = 0.0;
  config.dvl.beam_loss_rate = 0.0;
  return config;
}

}  // namespace seastitch::bench
