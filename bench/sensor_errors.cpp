#include "bench/sensor_errors.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace seastitch::bench {

SensorErrors SensorErrors::OfClass(const std::string& name) {
  SensorErrors e;
  if (name == "ideal") return e;
  e.depth_noise_m = 0.01;
  e.depth_bias_m = 0.02;
  e.dvl_range_noise_m = 0.02;
  if (name == "ins_tactical") {
    e.gyro_noise_radps_rthz = 1.5e-5;  // 0.05 deg/sqrt(h)
    e.gyro_bias_radps = 2.4e-6;        // 0.5 deg/h
    e.accel_noise_mps2_rthz = 5e-4;    // 50 ug/sqrt(Hz)
    e.accel_bias_mps2 = 2e-3;          // 200 ug
    e.roll_pitch_wander_deg = 0.02;
    e.heading_bias_deg = 0.10;
    e.heading_wander_deg = 0.10;
    e.heading_wander_tau_s = 1800.0;
    e.attitude_white_deg = 0.005;
    e.dvl_noise_mps = 0.006;
    e.dvl_scale = 0.002;
    e.dvl_misalignment_deg = 0.10;
    return e;
  }
  if (name == "mems") {
    e.gyro_noise_radps_rthz = 8.7e-5;  // 0.3 deg/sqrt(h)
    e.gyro_bias_radps = 4.8e-5;        // 10 deg/h, in run
    e.accel_noise_mps2_rthz = 1e-3;    // 100 ug/sqrt(Hz)
    e.accel_bias_mps2 = 2e-2;          // 2 mg
    e.roll_pitch_wander_deg = 0.10;
    e.heading_bias_deg = 0.6;
    e.heading_deviation_deg = 0.5;
    e.heading_wander_deg = 0.6;
    e.heading_wander_tau_s = 300.0;
    e.attitude_white_deg = 0.02;
    e.dvl_noise_mps = 0.010;
    e.dvl_scale = 0.005;
    e.dvl_misalignment_deg = 0.3;
    return e;
  }
  throw std::invalid_argument("no class " + name);
}

std::vector<std::string> SensorErrors::Classes() { return {"ideal", "ins_tactical", "mems"}; }

double SensorErrors::StatedHeadingSigmaDeg() const {
  return std::hypot(std::hypot(heading_bias_deg, heading_deviation_deg),
                    std::hypot(heading_wander_deg, attitude_white_deg));
}

double SensorErrors::StatedRollPitchSigmaDeg() const {
  return std::hypot(roll_pitch_wander_deg, attitude_white_deg);
}

}  // namespace seastitch::bench
