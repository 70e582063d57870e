#include "bench/survey_config.hpp"

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "common/runtime/config.hpp"

namespace seastitch::bench {
namespace {

void ReadTerrain(ConfigMap map, SurveyConfig* config) {
  ProceduralParams& p = config->terrain;
  map.Read("depth_m", &p.depth_m);
  map.Read("slope_north", &p.slope_north);
  map.Read("slope_east", &p.slope_east);

  ConfigMap raster = map.Child("raster");
  raster.Read("file", &config->raster.file);
  raster.Read("overlay", &config->raster.overlay);
  raster.Read("positive_down", &config->raster.positive_down);
  raster.Read("depth_offset_m", &config->raster.depth_offset_m);
  raster.Read("fill_m", &config->raster.fill_m);
  raster.Finish();
  raster.Check(config->raster.Validate());

  ConfigMap relief = map.Child("relief");
  relief.Read("rms_m", &p.relief.rms_m);
  relief.Read("longest_m", &p.relief.longest_m);
  relief.Read("shortest_m", &p.relief.shortest_m);
  relief.Read("hurst", &p.relief.hurst);
  relief.Finish();

  ConfigMap waves = map.Child("sand_waves");
  waves.Read("height_m", &p.sand_waves.height_m);
  waves.Read("length_m", &p.sand_waves.length_m);
  waves.Read("heading_deg", &p.sand_waves.heading_deg);
  waves.Finish();

  ConfigMap pipe = map.Child("pipeline");
  pipe.Read("diameter_m", &p.pipeline.diameter_m);
  pipe.Read("north_m", &p.pipeline.north_m);
  pipe.Read("east_m", &p.pipeline.east_m);
  pipe.Read("heading_deg", &p.pipeline.heading_deg);
  pipe.Finish();

  ConfigMap flat = map.Child("flat_strip");
  flat.Read("from_north_m", &p.flat_strip.from_north_m);
  flat.Read("to_north_m", &p.flat_strip.to_north_m);
  flat.Finish();
  map.Finish();
  map.Check(p.Validate());
}

void ReadPlan(ConfigMap map, PlanParams* p) {
  map.Read("lines", &p->lines);
  map.Read("line_length_m", &p->line_length_m);
  map.Read("spacing_m", &p->spacing_m);
  map.Read("heading_deg", &p->heading_deg);
  map.Read("turn_radius_m", &p->turn_radius_m);
  map.Read("crosslines", &p->crosslines);
  map.Read("lead_in_m", &p->lead_in_m);
  map.Read("speed_mps", &p->speed_mps);
  map.Read("altitude_m", &p->altitude_m);
  map.Read("depth_m", &p->depth_m);
  map.Read("min_depth_m", &p->min_depth_m);
  map.Finish();
  map.Check(p->Validate());
}

void ReadMotion(ConfigMap map, MotionParams* p) {
  map.Read("roll_rms_deg", &p->roll_rms_deg);
  map.Read("pitch_rms_deg", &p->pitch_rms_deg);
  map.Read("heading_rms_deg", &p->heading_rms_deg);
  map.Read("heave_rms_m", &p->heave_rms_m);
  map.Read("period_s", &p->period_s);
  map.Finish();
  map.Check(p->Validate());
}

void ReadWater(ConfigMap map, SurveyConfig* config) {
  map.Read("depth_m", &config->water.depth_m);
  map.Read("speed_mps", &config->water.speed_mps);
  map.Read("told_speed_error_mps", &config->told_speed_error_mps);
  map.Finish();
  map.Check(config->water.Validate());
}

void ReadErrors(ConfigMap map, SurveyConfig* config) {
  map.Read("class", &config->error_class);
  try {
    config->errors = SensorErrors::OfClass(config->error_class);
  } catch (const std::invalid_argument& e) {
    map.Check("class: '" + config->error_class + "': " + e.what());
  }
  SensorErrors& e = config->errors;
  map.Read("gyro_noise_radps_rthz", &e.gyro_noise_radps_rthz);
  map.Read("gyro_bias_radps", &e.gyro_bias_radps);
  map.Read("accel_noise_mps2_rthz", &e.accel_noise_mps2_rthz);
  map.Read("accel_bias_mps2", &e.accel_bias_mps2);
  map.Read("roll_pitch_wander_deg", &e.roll_pitch_wander_deg);
  map.Read("roll_pitch_wander_tau_s", &e.roll_pitch_wander_tau_s);
  map.Read("heading_bias_deg", &e.heading_bias_deg);
  map.Read("heading_deviation_deg", &e.heading_deviation_deg);
  map.Read("heading_wander_deg", &e.heading_wander_deg);
  map.Read("heading_wander_tau_s", &e.heading_wander_tau_s);
  map.Read("attitude_white_deg", &e.attitude_white_deg);
  map.Read("dvl_noise_mps", &e.dvl_noise_mps);
  map.Read("dvl_scale", &e.dvl_scale);
  map.Read("dvl_misalignment_deg", &e.dvl_misalignment_deg);
  map.Read("dvl_range_noise_m", &e.dvl_range_noise_m);
  map.Read("depth_noise_m", &e.depth_noise_m);
  map.Read("depth_bias_m", &e.depth_bias_m);
  map.Finish();
  map.Check(e.Validate());
}

void ReadDevices(ConfigMap* root, SurveyConfig* config) {
  ConfigMap imu = root->Child("imu");
  imu.Read("rate_hz", &config->imu.rate_hz);
  imu.Read("latency_s", &config->imu.latency_s);
  imu.Finish();
  imu.Check(config->imu.Validate());

  ConfigMap dvl = root->Child("dvl");
  dvl.Read("rate_hz", &config->dvl.rate_hz);
  dvl.Read("beam_angle_deg", &config->dvl.beam_angle_deg);
  dvl.Read("min_range_m", &config->dvl.min_range_m);
  dvl.Read("max_range_m", &config->dvl.max_range_m);
  dvl.Read("beam_loss_rate", &config->dvl.beam_loss_rate);
  dvl.Read("latency_s", &config->dvl.latency_s);
  dvl.Finish();
  dvl.Check(config->dvl.Validate());
}

void ReadMbes(ConfigMap map, MbesParams* p) {
  map.Read("beams", &p->beams);
  map.Read("swath_deg", &p->swath_deg);
  map.Read("equidistant", &p->equidistant);
  map.Read("ping_rate_hz", &p->ping_rate_hz);
  map.Read("max_ping_rate_hz", &p->max_ping_rate_hz);
  map.Read("max_range_m", &p->max_range_m);
  map.Read("roll_stabilised", &p->roll_stabilised);
  map.Read("sector_tilt_deg", &p->sector_tilt_deg);
  map.Read("sector_delay_s", &p->sector_delay_s);
  map.Read("range_noise_m", &p->range_noise_m);
  map.Read("range_noise_ratio", &p->range_noise_ratio);
  map.Read("angle_noise_deg", &p->angle_noise_deg);
  map.Read("outlier_rate", &p->outlier_rate);
  map.Read("drop_rate", &p->drop_rate);
  map.Read("misdetection_rate", &p->misdetection_rate);
  map.Read("latency_s", &p->latency_s);
  map.Finish();
  map.Check(p->Validate());
}

void ReadFixes(ConfigMap map, FixParams* p) {
  map.Read("interval_s", &p->interval_s);
  map.Read("sigma_m", &p->sigma_m);
  map.Read("wrong_rate", &p->wrong_rate);
  map.Read("wrong_m", &p->wrong_m);
  map.Finish();
  map.Check(p->Validate());
}

Fault ReadFault(ConfigMap map) {
  Fault fault;
  std::string kind;
  std::string device = "mbes";
  map.Require("kind", &kind);
  map.Read("device", &device);
  map.Read("from_s", &fault.from_s);
  map.Read("to_s", &fault.to_s);
  map.Read("rate", &fault.rate);
  map.Finish();
  try {
    fault.kind = FaultKindFrom(kind);
    fault.device = DeviceFrom(device);
  } catch (const std::invalid_argument& e) {
    map.Check(e.what());
  }
  map.Check(fault.Validate());
  return fault;
}

}  // namespace

std::string SurveyConfig::Validate() const {
  for (const std::string& problem : {terrain.Validate(),
                                     raster.Validate(),
                                     plan.Validate(),
                                     motion.Validate(),
                                     water.Validate(),
                                     errors.Validate(),
                                     imu.Validate(),
                                     dvl.Validate(),
                                     mbes.Validate(),
                                     fixes.Validate()})
    if (!problem.empty()) return problem;
  for (const Fault& fault : faults)
    if (const std::string problem = fault.Validate(); !problem.empty()) return problem;
  if (!(std::abs(told_speed_error_mps) <= 50.0)) return "told_speed_error_mps must be -50 to 50";
  return "";
}

SurveyConfig LoadSurvey(const std::string& path) {
  ConfigMap root = ConfigMap::Load(path);
  SurveyConfig config;
  root.Read("seed", &config.seed);
  ReadTerrain(root.Child("terrain"), &config);
  ReadPlan(root.Child("plan"), &config.plan);
  ReadMotion(root.Child("motion"), &config.motion);
  ReadWater(root.Child("water"), &config);
  ReadErrors(root.Child("errors"), &config);
  ReadDevices(&root, &config);
  ReadMbes(root.Child("mbes"), &config.mbes);
  ReadFixes(root.Child("position_fixes"), &config.fixes);
  for (const ConfigMap& fault : root.Children("faults")) config.faults.push_back(ReadFault(fault));
  root.Finish();
  root.Check(config.Validate());

  std::string& file = config.raster.file;
  if (!file.empty() && std::filesystem::path(file).is_relative())
    file = (std::filesystem::path(path).parent_path() / file).string();
  return config;
}

}  // namespace seastitch::bench
