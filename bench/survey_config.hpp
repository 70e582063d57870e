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
#include "common/parameters/parameters.hpp"

namespace seastitch::bench {

// 2026-01-01T00:00:00Z: default start of a simulated survey, by the devices' clocks.
constexpr Time kSurveyStart = FromUtime(1'767'225'600'000'000);

// All of a simulated survey. The same config gives the same bytes.
struct SurveyConfig {
  std::uint64_t seed = 1;
  Time start = kSurveyStart;  // no key of the file
  // With a raster, the raster is the seabed, and of this only the relief, waves and pipeline may be
  // added to it.
  ProceduralParams terrain;
  RasterParams raster;
  PlanParams plan;
  MotionParams motion;
  WaterParams water;
  // Error of the sonar's #SVP, which the mapper uses, equal at every depth.
  double profile_speed_error_mps = 0.0;
  std::string error_class = "ins_tactical";
  SensorErrors errors = SensorErrors::OfClass("ins_tactical");
  ImuParams imu;
  DvlParams dvl;
  MbesParams mbes;
  FixParams fixes;
  std::vector<Fault> faults;
};

// Reads config/bench/*.yaml. Throws ConfigError. A raster's file is taken relative to the folder of
// `path`.
SurveyConfig LoadSurvey(const std::string& path);
// "KIND" or "KIND:key=value,key=value", such as "packet_loss:device=mbes,rate=0.01,from_s=60" or
// "dvl_dropout:from_s=300,to_s=330". Throws std::invalid_argument "'TEXT': what was expected".
Fault ParseFault(const std::string& text);

std::string PrintConfig(const SurveyConfig& config);
ParameterTable TableOf(SurveyConfig* config);

}  // namespace seastitch::bench
