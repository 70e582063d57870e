#include "mapper/mapper_config.hpp"

#include <cmath>
#include <vector>

#include "common/runtime/config.hpp"
#include "common/runtime/vehicle_config.hpp"
#include "mapper/geometry/sound_ray.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

// Degrees in files, radians inside.
void ReadDegrees(ConfigMap* map, const std::string& key, double* rad) {
  double deg = Rad2Deg(*rad);
  map->Read(key, &deg);
  *rad = Deg2Rad(deg);
}

void ReadDegrees(ConfigMap* map, const std::string& key, Eigen::Vector2d* rad) {
  std::vector<double> deg{Rad2Deg(rad->x()), Rad2Deg(rad->y())};
  map->Read(key, &deg);
  if (deg.size() != 2) map->Check(key + " must have 2 numbers");
  *rad = {Deg2Rad(deg[0]), Deg2Rad(deg[1])};
}

void ReadDegrees(ConfigMap* map, const std::string& key, Eigen::Vector3d* rad) {
  std::vector<double> deg{Rad2Deg(rad->x()), Rad2Deg(rad->y()), Rad2Deg(rad->z())};
  map->Read(key, &deg);
  if (deg.size() != 3) map->Check(key + " must have 3 numbers");
  *rad = {Deg2Rad(deg[0]), Deg2Rad(deg[1]), Deg2Rad(deg[2])};
}

fs::path Beside(const ConfigMap& map, const fs::path& path) {
  return path.is_absolute() ? path : fs::path(map.file()).parent_path() / path;
}

void ReadNavigation(ConfigMap map, NavigationParams* p) {
  map.Read("gyro_noise_radps_rthz", &p->gyro_noise_radps_rthz);
  map.Read("accel_noise_mps2_rthz", &p->accel_noise_mps2_rthz);
  map.Read("gyro_step_radps", &p->gyro_step_radps);
  map.Read("accel_step_mps2", &p->accel_step_mps2);
  map.Read("step_correlation_s", &p->step_correlation_s);
  map.Read("gyro_bias_radps", &p->gyro_bias_radps.sigma);
  map.Read("gyro_bias_tau_s", &p->gyro_bias_radps.tau_s);
  map.Read("accel_bias_mps2", &p->accel_bias_mps2.sigma);
  map.Read("accel_bias_tau_s", &p->accel_bias_mps2.tau_s);
  ReadDegrees(&map, "attitude_roll_pitch_deg", &p->attitude_roll_pitch_rad.sigma);
  map.Read("attitude_roll_pitch_tau_s", &p->attitude_roll_pitch_rad.tau_s);
  ReadDegrees(&map, "attitude_heading_deg", &p->attitude_heading_rad.sigma);
  map.Read("attitude_heading_tau_s", &p->attitude_heading_rad.tau_s);
  ReadDegrees(&map, "attitude_heading_wander_deg", &p->attitude_heading_wander_rad.sigma);
  map.Read("attitude_heading_wander_tau_s", &p->attitude_heading_wander_rad.tau_s);
  ReadDegrees(&map, "attitude_deviation_deg", &p->attitude_deviation_rad);
  ReadDegrees(&map, "attitude_white_deg", &p->attitude_white_rad);
  map.Read("attitude_interval_s", &p->attitude_interval_s);
  map.Read("dvl_sigma_mps", &p->dvl_sigma_mps);
  map.Read("dvl_sigma_floor_mps", &p->dvl_sigma_floor_mps);
  map.Read("dvl_scale", &p->dvl_scale.sigma);
  map.Read("dvl_scale_tau_s", &p->dvl_scale.tau_s);
  ReadDegrees(&map, "dvl_mounting_deg", &p->dvl_mounting_rad.sigma);
  map.Read("dvl_mounting_tau_s", &p->dvl_mounting_rad.tau_s);
  map.Read("dvl_sound_speed_mps", &p->dvl_sound_speed_mps);
  map.Read("bottom_lock_timeout_s", &p->bottom_lock_timeout_s);
  map.Read("depth_sigma_m", &p->depth_sigma_m);
  map.Read("depth_sigma_floor_m", &p->depth_sigma_floor_m);
  map.Read("depth_bias_m", &p->depth_bias_m.sigma);
  map.Read("depth_bias_tau_s", &p->depth_bias_m.tau_s);
  map.Read("gate_sigma", &p->gate_sigma);
  map.Read("gate_reset_s", &p->gate_reset_s);
  map.Read("start_at_first_fix", &p->start_at_first_fix);
  map.Read("start_north_m", &p->start_north_m);
  map.Read("start_east_m", &p->start_east_m);
  map.Read("start_sigma_m", &p->start_sigma_m);
  map.Read("fuse_position_fixes", &p->fuse_position_fixes);
  map.Read("fix_interval_s", &p->fix_interval_s);
  map.Read("start_wait_s", &p->start_wait_s);
  map.Read("start_speed_sigma_mps", &p->start_speed_sigma_mps);
  map.Read("start_depth_sigma_m", &p->start_depth_sigma_m);
  map.Read("reorder_window_s", &p->reorder_window_s);
  map.Read("imu_gap_s", &p->imu_gap_s);
  map.Read("coast_speed_sigma_mps", &p->coast_speed_sigma_mps);
  map.Read("clock_jump_s", &p->clock_jump_s);
  map.Read("clock_jump_samples", &p->clock_jump_samples);
  map.Read("pose_window_s", &p->pose_window_s);
  map.Read("window_s", &p->window_s);
  map.Read("epoch_interval_s", &p->epoch_interval_s);
  map.Read("key_interval_s", &p->key_interval_s);
  map.Finish();
  map.Check(p->Validate());
}

void ReadSubmap(ConfigMap map, SubmapParams* p) {
  map.Read("min_length_m", &p->min_length_m);
  map.Read("max_length_m", &p->max_length_m);
  map.Read("max_duration_s", &p->max_duration_s);
  map.Read("max_drift_m", &p->max_drift_m);
  map.Read("max_soundings", &p->max_soundings);
  map.Read("min_points", &p->min_points);
  map.Read("expected_overlap", &p->expected_overlap);
  map.Read("sounding_sigma_m", &p->sounding_sigma_m);
  ReadDegrees(&map, "turn_deg", &p->turn_rad);
  map.Read("turn_sustain_m", &p->turn_sustain_m);
  map.Read("turn_settle_m", &p->turn_settle_m);
  map.Read("keep_turns", &p->keep_turns);
  map.Read("max_gap_s", &p->max_gap_s);
  map.Read("max_gap_m", &p->max_gap_m);
  map.Finish();
  map.Check(p->Validate());
}

void ReadFilter(ConfigMap map, CloudFilterParams* p) {
  map.Read("min_range_m", &p->min_range_m);
  map.Read("max_range_m", &p->max_range_m);
  map.Read("voxel_m", &p->voxel_m);
  map.Read("min_spike_m", &p->min_spike_m);
  map.Read("spike_sigmas", &p->spike_sigmas);
  map.Read("min_support", &p->min_support);
  map.Read("min_support_part", &p->min_support_part);
  map.Read("min_neighbours", &p->min_neighbours);
  map.Read("soundings_per_column", &p->soundings_per_column);
  map.Finish();
  map.Check(p->Validate());
}

void ReadOverlap(ConfigMap map, OverlapParams* p) {
  map.Read("min_overlap_m2", &p->min_overlap_m2);
  map.Read("min_overlap_part", &p->min_overlap_part);
  map.Read("max_pairs", &p->max_pairs);
  map.Finish();
  map.Check(p->Validate());
}

void ReadRegistration(ConfigMap map, LoopCloserParams* params) {
  RegistrationParams* p = &params->registration;
  std::string method = "grid";
  map.Read("method", &method);
  if (method != "grid" && method != "gicp")
    map.Check("method = " + method + ", must be grid or gicp");
  params->method = method == "gicp" ? RegistrationMethod::kGicp : RegistrationMethod::kGrid;
  map.Read("gicp_voxel_m", &params->gicp.voxel_m);
  map.Read("z_sigma_m", &params->z_sigma_m);
  map.Read("min_cell_m", &p->min_cell_m);
  map.Read("cell_per_spacing", &p->cell_per_spacing);
  map.Read("num_levels", &p->num_levels);
  map.Read("max_cells", &p->max_cells);
  map.Read("window_sigma", &p->window_sigma);
  map.Read("max_modes", &p->max_modes);
  map.Read("max_search_cells", &p->max_search_cells);
  map.Read("min_sounding_sigma_m", &p->min_sounding_sigma_m);
  map.Read("shared_error_ratio", &p->shared_error_ratio);
  map.Read("shared_error_length_m", &p->shared_error_length_m);
  map.Read("min_position_sigma_m", &p->min_position_sigma_m);
  map.Read("min_overlap_m2", &p->min_overlap_m2);
  map.Read("min_patches", &p->min_patches);
  map.Read("ambiguity_per_patch", &p->ambiguity_per_patch);
  map.Read("ambiguity_floor", &p->ambiguity_floor);
  map.Read("max_misfit", &p->max_misfit);
  map.Read("min_slope_significance", &p->min_slope_significance);
  map.Read("max_prior_chi2", &p->max_prior_chi2);
  map.Finish();
  map.Check(p->Validate());
  map.Check(params->gicp.Validate());
  map.Check(params->Validate());
}

std::optional<SoundVelocityProfile> ReadProfile(ConfigMap map) {
  SoundVelocityProfile profile;
  map.Read("depth_m", &profile.depth_m);
  map.Read("speed_mps", &profile.speed_mps);
  map.Finish();
  if (profile.depth_m.empty() && profile.speed_mps.empty()) return std::nullopt;
  if (profile.depth_m.size() != profile.speed_mps.size())
    map.Check("speed_mps must have as many numbers as depth_m");
  if (!RayTracer::Make(profile)) map.Check("depth_m must rise, with sea water's speed_mps");
  return profile;
}

}  // namespace

MapperConfig LoadMapperConfig(const std::string& path) {
  MapperConfig config;
  ConfigMap root = ConfigMap::Load(path);
  std::string vehicle;
  root.Require("vehicle", &vehicle);
  config.vehicle = LoadVehicle(Beside(root, vehicle).string());
  std::string survey_dir = config.survey_dir.string();
  root.Read("survey_dir", &survey_dir);
  if (survey_dir.empty()) root.Check("survey_dir must name a directory");
  config.survey_dir = Beside(root, survey_dir);
  root.Read("max_cached_mb", &config.max_cached_mb);
  if (config.max_cached_mb < 0) root.Check("max_cached_mb must be >= 0");
  root.Read("max_unsaved_mb", &config.max_unsaved_mb);
  if (config.max_unsaved_mb < 0) root.Check("max_unsaved_mb must be >= 0");
  root.Read("nav_rate_hz", &config.nav_rate_hz);
  if (!(config.nav_rate_hz > 0.0 && config.nav_rate_hz <= 1000.0))
    root.Check("nav_rate_hz must be above 0 and at most 1000");
  root.Read("max_waiting_pings", &config.max_waiting_pings);
  if (config.max_waiting_pings < 1 || config.max_waiting_pings > 10'000)
    root.Check("max_waiting_pings must be within 1 and 10000");
  root.Read("max_waiting_submaps", &config.max_waiting_submaps);
  if (config.max_waiting_submaps < 1 || config.max_waiting_submaps > 1000)
    root.Check("max_waiting_submaps must be within 1 and 1000");
  root.Read("sonar_mounting_m", &config.mounting.sonar_m);
  if (!config.mounting.AreUsable()) root.Check("sonar_mounting_m must be 0 to 10");
  double sonar_mounting_rad = Deg2Rad(0.1);
  ReadDegrees(&root, "sonar_mounting_deg", &sonar_mounting_rad);
  if (!(sonar_mounting_rad >= 0.0 && sonar_mounting_rad < kPi))
    root.Check("sonar_mounting_deg must be 0 to 180");
  ReadNavigation(root.Child("navigation"), &config.navigation);
  ReadSubmap(root.Child("submap"), &config.submap);
  ReadFilter(root.Child("filter"), &config.filter);
  ReadOverlap(root.Child("overlap"), &config.loop_closer.overlap);
  ReadRegistration(root.Child("registration"), &config.loop_closer);
  config.sound_velocity_profile = ReadProfile(root.Child("sound_velocity_profile"));
  root.Finish();
  if (config.navigation.window_s < 2.0 * config.submap.max_duration_s)
    root.Check("navigation.window_s must be at least 2 x submap.max_duration_s");
  config.mounting.dvl_yaw_rad =
      std::hypot(config.navigation.dvl_mounting_rad.sigma, sonar_mounting_rad);
  config.loop_closer.expected_overlap = config.submap.expected_overlap;
  return config;
}

}  // namespace seastitch
