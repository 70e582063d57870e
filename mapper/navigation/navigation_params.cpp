#include "mapper/navigation/navigation_params.hpp"

#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace seastitch {
namespace {

constexpr double kEarthRadiusM = 6.371e6;
constexpr double kQuarterMeridianKm = 1e4;

using Named = std::pair<const char*, double>;

void Require(bool holds, const Named& value, const char* expected) {
  if (holds && std::isfinite(value.second)) return;
  std::ostringstream text;
  text << value.first << " = " << value.second << ", must be " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

double DeclinationAt(const NavigationParams& p, Time t) {
  constexpr double kYearS = 365.2425 * 86'400.0;
  const double year = 1970.0 + ToSeconds(t.time_since_epoch()) / kYearS;
  return p.declination_rad + p.declination_rad_per_year * (year - p.declination_year);
}

double ConvergenceLimitM(const NavigationParams& p, double datum_latitude_rad) {
  return p.attitude_heading_rad.sigma * kEarthRadiusM / std::abs(std::tan(datum_latitude_rad));
}

std::string NorthSentence(const NavigationParams& p, double datum_latitude_rad) {
  const double limit_km = 1e-3 * ConvergenceLimitM(p, datum_latitude_rad);
  const double transport_degph = Rad2Deg(p.max_speed_mps / kEarthRadiusM) * 3600.0;
  char text[240];
  if (limit_km < kQuarterMeridianKm)
    std::snprintf(
        text,
        sizeof text,
        "north is the datum's: beyond %.3g km east or west of it the meridians are turned "
        "by more than the heading sensor's sigma; the transport rate left out is at most "
        "%.2f deg/h",
        limit_km,
        transport_degph);
  else
    std::snprintf(text,
                  sizeof text,
                  "north is the datum's: so near the equator the meridians turn by less than the "
                  "heading sensor's sigma; the transport rate left out is at most %.2f deg/h",
                  transport_degph);
  return text;
}

void CheckParams(const NavigationParams& p) {
  for (const Named& value :
       {Named{"NavigationParams::gyro_noise_radps_rthz", p.gyro_noise_radps_rthz},
        {"NavigationParams::accel_noise_mps2_rthz", p.accel_noise_mps2_rthz},
        {"NavigationParams::gyro_bias_radps.sigma", p.gyro_bias_radps.sigma},
        {"NavigationParams::gyro_bias_radps.tau_s", p.gyro_bias_radps.tau_s},
        {"NavigationParams::accel_bias_mps2.sigma", p.accel_bias_mps2.sigma},
        {"NavigationParams::accel_bias_mps2.tau_s", p.accel_bias_mps2.tau_s},
        {"NavigationParams::attitude_roll_pitch_rad.sigma",
         p.attitude_roll_pitch_rad.sigma.minCoeff()},
        {"NavigationParams::attitude_roll_pitch_rad.tau_s", p.attitude_roll_pitch_rad.tau_s},
        {"NavigationParams::attitude_heading_rad.sigma", p.attitude_heading_rad.sigma},
        {"NavigationParams::attitude_heading_rad.tau_s", p.attitude_heading_rad.tau_s},
        {"NavigationParams::attitude_heading_wander_rad.tau_s",
         p.attitude_heading_wander_rad.tau_s},
        {"NavigationParams::attitude_white_rad", p.attitude_white_rad.minCoeff()},
        {"NavigationParams::attitude_interval_s", p.attitude_interval_s},
        {"NavigationParams::dvl_sigma_mps", p.dvl_sigma_mps},
        {"NavigationParams::dvl_sigma_floor_mps", p.dvl_sigma_floor_mps},
        {"NavigationParams::dvl_scale.sigma", p.dvl_scale.sigma},
        {"NavigationParams::dvl_scale.tau_s", p.dvl_scale.tau_s},
        {"NavigationParams::dvl_mounting_rad.sigma", p.dvl_mounting_rad.sigma},
        {"NavigationParams::dvl_mounting_rad.tau_s", p.dvl_mounting_rad.tau_s},
        {"NavigationParams::bottom_lock_timeout_s", p.bottom_lock_timeout_s},
        {"NavigationParams::max_speed_mps", p.max_speed_mps},
        {"NavigationParams::max_acceleration_mps2", p.max_acceleration_mps2},
        {"NavigationParams::depth_sigma_m", p.depth_sigma_m},
        {"NavigationParams::depth_sigma_floor_m", p.depth_sigma_floor_m},
        {"NavigationParams::depth_bias_m.tau_s", p.depth_bias_m.tau_s},
        {"NavigationParams::gate_sigma", p.gate_sigma},
        {"NavigationParams::gate_reset_s", p.gate_reset_s},
        {"NavigationParams::start_sigma_m", p.start_sigma_m},
        {"NavigationParams::start_wait_s", p.start_wait_s},
        {"NavigationParams::start_heading_sigma_rad", p.start_heading_sigma_rad},
        {"NavigationParams::start_speed_sigma_mps", p.start_speed_sigma_mps},
        {"NavigationParams::start_depth_sigma_m", p.start_depth_sigma_m},
        {"NavigationParams::imu_gap_s", p.imu_gap_s},
        {"NavigationParams::coast_speed_sigma_mps", p.coast_speed_sigma_mps},
        {"NavigationParams::clock_jump_s", p.clock_jump_s},
        {"NavigationParams::pose_window_s", p.pose_window_s},
        {"NavigationParams::epoch_interval_s", p.epoch_interval_s},
        {"NavigationParams::key_interval_s", p.key_interval_s}})
    Require(value.second > 0.0, value, "above 0");
  for (const Named& value : {Named{"NavigationParams::gyro_step_radps", p.gyro_step_radps},
                             {"NavigationParams::accel_step_mps2", p.accel_step_mps2},
                             {"NavigationParams::step_correlation_s", p.step_correlation_s},
                             {"NavigationParams::attitude_heading_wander_rad.sigma",
                              p.attitude_heading_wander_rad.sigma},
                             {"NavigationParams::attitude_deviation_rad", p.attitude_deviation_rad},
                             {"NavigationParams::attitude_time_sigma_s", p.attitude_time_sigma_s},
                             {"NavigationParams::dvl_time_sigma_s", p.dvl_time_sigma_s},
                             {"NavigationParams::depth_bias_m.sigma", p.depth_bias_m.sigma},
                             {"NavigationParams::fix_interval_s", p.fix_interval_s},
                             {"NavigationParams::reorder_window_s", p.reorder_window_s}})
    Require(value.second >= 0.0, value, "at least 0");
  for (const Named& value :
       {Named{"NavigationParams::start_north_m", p.start_north_m},
        {"NavigationParams::start_east_m", p.start_east_m},
        {"NavigationParams::attitude_time_offset_s", p.attitude_time_offset_s},
        {"NavigationParams::declination_rad", p.declination_rad},
        {"NavigationParams::declination_year", p.declination_year},
        {"NavigationParams::declination_rad_per_year", p.declination_rad_per_year},
        {"NavigationParams::dvl_time_offset_s", p.dvl_time_offset_s}})
    Require(true, value, "finite");
  Require(p.imu_gap_s <= 1.0, {"NavigationParams::imu_gap_s", p.imu_gap_s}, "at most 1");
  Require(p.clock_jump_samples >= 2,
          {"NavigationParams::clock_jump_samples", p.clock_jump_samples},
          "at least 2");
  Require(p.window_s >= p.pose_window_s,
          {"NavigationParams::window_s", p.window_s},
          "at least pose_window_s");
}

}  // namespace seastitch
