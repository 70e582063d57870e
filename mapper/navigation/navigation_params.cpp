#include "mapper/navigation/navigation_params.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace seastitch {
namespace {

using Named = std::pair<const char*, double>;

void Require(bool holds, const Named& value, const char* expected) {
  if (holds && std::isfinite(value.second)) return;
  std::ostringstream text;
  text << "NavigationParams: " << value.first << " = " << value.second << ", must be " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

void CheckParams(const NavigationParams& p) {
  for (const Named& value :
       {Named{"gyro_noise_radps_rthz", p.gyro_noise_radps_rthz},
        {"accel_noise_mps2_rthz", p.accel_noise_mps2_rthz},
        {"gyro_bias_radps.sigma", p.gyro_bias_radps.sigma},
        {"gyro_bias_radps.tau_s", p.gyro_bias_radps.tau_s},
        {"accel_bias_mps2.sigma", p.accel_bias_mps2.sigma},
        {"accel_bias_mps2.tau_s", p.accel_bias_mps2.tau_s},
        {"attitude_roll_pitch_rad.sigma", p.attitude_roll_pitch_rad.sigma.minCoeff()},
        {"attitude_roll_pitch_rad.tau_s", p.attitude_roll_pitch_rad.tau_s},
        {"attitude_heading_rad.sigma", p.attitude_heading_rad.sigma},
        {"attitude_heading_rad.tau_s", p.attitude_heading_rad.tau_s},
        {"attitude_heading_wander_rad.tau_s", p.attitude_heading_wander_rad.tau_s},
        {"attitude_white_rad", p.attitude_white_rad.minCoeff()},
        {"attitude_interval_s", p.attitude_interval_s},
        {"dvl_sigma_mps", p.dvl_sigma_mps},
        {"dvl_sigma_floor_mps", p.dvl_sigma_floor_mps},
        {"dvl_scale.sigma", p.dvl_scale.sigma},
        {"dvl_scale.tau_s", p.dvl_scale.tau_s},
        {"dvl_mounting_rad.sigma", p.dvl_mounting_rad.sigma},
        {"dvl_mounting_rad.tau_s", p.dvl_mounting_rad.tau_s},
        {"bottom_lock_timeout_s", p.bottom_lock_timeout_s},
        {"max_speed_mps", p.max_speed_mps},
        {"max_acceleration_mps2", p.max_acceleration_mps2},
        {"depth_sigma_m", p.depth_sigma_m},
        {"depth_sigma_floor_m", p.depth_sigma_floor_m},
        {"depth_bias_m.tau_s", p.depth_bias_m.tau_s},
        {"gate_sigma", p.gate_sigma},
        {"gate_reset_s", p.gate_reset_s},
        {"start_sigma_m", p.start_sigma_m},
        {"start_wait_s", p.start_wait_s},
        {"start_heading_sigma_rad", p.start_heading_sigma_rad},
        {"start_speed_sigma_mps", p.start_speed_sigma_mps},
        {"start_depth_sigma_m", p.start_depth_sigma_m},
        {"imu_gap_s", p.imu_gap_s},
        {"coast_speed_sigma_mps", p.coast_speed_sigma_mps},
        {"clock_jump_s", p.clock_jump_s},
        {"pose_window_s", p.pose_window_s},
        {"epoch_interval_s", p.epoch_interval_s},
        {"key_interval_s", p.key_interval_s}})
    Require(value.second > 0.0, value, "above 0");
  for (const Named& value :
       {Named{"gyro_step_radps", p.gyro_step_radps},
        {"accel_step_mps2", p.accel_step_mps2},
        {"step_correlation_s", p.step_correlation_s},
        {"attitude_heading_wander_rad.sigma", p.attitude_heading_wander_rad.sigma},
        {"attitude_deviation_rad", p.attitude_deviation_rad},
        {"attitude_time_sigma_s", p.attitude_time_sigma_s},
        {"dvl_time_sigma_s", p.dvl_time_sigma_s},
        {"depth_bias_m.sigma", p.depth_bias_m.sigma},
        {"fix_interval_s", p.fix_interval_s},
        {"reorder_window_s", p.reorder_window_s}})
    Require(value.second >= 0.0, value, "at least 0");
  for (const Named& value : {Named{"start_north_m", p.start_north_m},
                             {"start_east_m", p.start_east_m},
                             {"attitude_time_offset_s", p.attitude_time_offset_s},
                             {"dvl_time_offset_s", p.dvl_time_offset_s}})
    Require(true, value, "finite");
  Require(p.imu_gap_s <= 1.0, {"imu_gap_s", p.imu_gap_s}, "at most 1");
  Require(p.clock_jump_samples >= 2, {"clock_jump_samples", p.clock_jump_samples}, "at least 2");
  Require(p.window_s >= p.pose_window_s, {"window_s", p.window_s}, "at least pose_window_s");
}

}  // namespace seastitch
