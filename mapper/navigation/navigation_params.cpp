#include "mapper/navigation/navigation_params.hpp"

#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

namespace seastitch {
namespace {

std::string Problem(const char* name, double value, const char* expected) {
  std::ostringstream text;
  text << name << " = " << value << ", must be " << expected;
  return text.str();
}

}  // namespace

std::string NavigationParams::Validate() const {
  const std::vector<std::pair<const char*, double>> positive = {
      {"gyro_noise_radps_rthz", gyro_noise_radps_rthz},
      {"accel_noise_mps2_rthz", accel_noise_mps2_rthz},
      {"gyro_bias_radps.sigma", gyro_bias_radps.sigma},
      {"gyro_bias_radps.tau_s", gyro_bias_radps.tau_s},
      {"accel_bias_mps2.sigma", accel_bias_mps2.sigma},
      {"accel_bias_mps2.tau_s", accel_bias_mps2.tau_s},
      {"attitude_roll_pitch_rad.sigma", attitude_roll_pitch_rad.sigma.minCoeff()},
      {"attitude_roll_pitch_rad.tau_s", attitude_roll_pitch_rad.tau_s},
      {"attitude_heading_rad.sigma", attitude_heading_rad.sigma},
      {"attitude_heading_rad.tau_s", attitude_heading_rad.tau_s},
      {"attitude_heading_wander_rad.tau_s", attitude_heading_wander_rad.tau_s},
      {"attitude_white_rad", attitude_white_rad.minCoeff()},
      {"attitude_interval_s", attitude_interval_s},
      {"dvl_sigma_mps", dvl_sigma_mps},
      {"dvl_sigma_floor_mps", dvl_sigma_floor_mps},
      {"dvl_scale.sigma", dvl_scale.sigma},
      {"dvl_scale.tau_s", dvl_scale.tau_s},
      {"dvl_mounting_rad.sigma", dvl_mounting_rad.sigma},
      {"dvl_mounting_rad.tau_s", dvl_mounting_rad.tau_s},
      {"bottom_lock_timeout_s", bottom_lock_timeout_s},
      {"depth_sigma_m", depth_sigma_m},
      {"depth_sigma_floor_m", depth_sigma_floor_m},
      {"depth_bias_m.tau_s", depth_bias_m.tau_s},
      {"gate_sigma", gate_sigma},
      {"gate_reset_s", gate_reset_s},
      {"start_sigma_m", start_sigma_m},
      {"start_wait_s", start_wait_s},
      {"start_speed_sigma_mps", start_speed_sigma_mps},
      {"start_depth_sigma_m", start_depth_sigma_m},
      {"imu_gap_s", imu_gap_s},
      {"coast_speed_sigma_mps", coast_speed_sigma_mps},
      {"epoch_interval_s", epoch_interval_s},
      {"key_interval_s", key_interval_s},
  };
  for (const auto& [name, value] : positive)
    if (!(value > 0.0) || !std::isfinite(value)) return Problem(name, value, "above 0");

  const std::vector<std::pair<const char*, double>> not_negative = {
      {"gyro_step_radps", gyro_step_radps},
      {"accel_step_mps2", accel_step_mps2},
      {"attitude_heading_wander_rad.sigma", attitude_heading_wander_rad.sigma},
      {"attitude_deviation_rad", attitude_deviation_rad},
      {"depth_bias_m.sigma", depth_bias_m.sigma},
      {"step_correlation_s", step_correlation_s},
      {"reorder_window_s", reorder_window_s},
  };
  for (const auto& [name, value] : not_negative)
    if (!(value >= 0.0) || !std::isfinite(value)) return Problem(name, value, "0 or more");

  if (dvl_sound_speed_mps != 0.0 &&
      !(dvl_sound_speed_mps >= 1300.0 && dvl_sound_speed_mps <= 1800.0))
    return Problem("dvl_sound_speed_mps", dvl_sound_speed_mps, "0 or within 1300 and 1800");
  if (!std::isfinite(start_north_m)) return Problem("start_north_m", start_north_m, "finite");
  if (!std::isfinite(start_east_m)) return Problem("start_east_m", start_east_m, "finite");
  if (!(imu_gap_s <= 1.0)) return Problem("imu_gap_s", imu_gap_s, "at most 1");
  if (!(clock_jump_s > reorder_window_s && clock_jump_s <= 60.0))
    return Problem("clock_jump_s", clock_jump_s, "above reorder_window_s and at most 60");
  if (clock_jump_samples < 2) return Problem("clock_jump_samples", clock_jump_samples, "2 or more");
  if (!(pose_window_s >= 1.0 && pose_window_s <= 3600.0))
    return Problem("pose_window_s", pose_window_s, "within 1 and 3600");
  if (!(window_s >= pose_window_s && window_s <= 36000.0))
    return Problem("window_s", window_s, "within pose_window_s and 36000");
  return {};
}

}  // namespace seastitch
