#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/fault.hpp"
#include "bench/path.hpp"
#include "bench/sensor_errors.hpp"
#include "bench/sensor_models.hpp"
#include "bench/terrain.hpp"
#include "bench/terrain_raster.hpp"
#include "bench/trajectory.hpp"
#include "bench/water.hpp"

namespace seastitch::bench {

// All of a simulated survey. The same config gives the same bytes.
struct SurveyConfig {
  std::uint64_t seed = 1;
  // Where there is a raster it is the seabed, and of the procedural terrain at most what lies on
  // it.
  ProceduralParams terrain;
  RasterParams raster;
  PlanParams plan;
  MotionParams motion;
  WaterParams water;
  // The sonar's #SVP, which is what the mapper is told, is off by this everywhere.
  double told_speed_error_mps = 0.0;
  std::string error_class = "ins_tactical";
  SensorErrors errors = SensorErrors::OfClass("ins_tactical");
  ImuParams imu;
  DvlParams dvl;
  MbesParams mbes;
  FixParams fixes;
  std::vector<Fault> faults;

  std::string Validate() const;
};

// Reads config/bench/*.yaml. Throws ConfigError. A raster's file is taken relative to the folder of
// `path`.
SurveyConfig LoadSurvey(const std::string& path);

}  // namespace seastitch::bench
