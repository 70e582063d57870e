#pragma once

#include <string>
#include <vector>

namespace seastitch::bench {

// Errors of the navigation sensors. Constant errors are drawn once per survey from a normal
// distribution with the sigma given here; wandering errors are first-order Gauss-Markov processes.
struct SensorErrors {
  double gyro_noise_radps_rthz = 0.0;
  double gyro_bias_radps = 0.0;  // constant, each axis
  double accel_noise_mps2_rthz = 0.0;
  double accel_bias_mps2 = 0.0;  // constant, each axis

  double roll_pitch_wander_deg = 0.0;
  double roll_pitch_wander_tau_s = 300.0;
  double heading_bias_deg = 0.0;  // constant
  // coefficients of sine and cosine of the heading: the remainder of hard iron
  double heading_deviation_deg = 0.0;
  double heading_wander_deg = 0.0;
  double heading_wander_tau_s = 600.0;
  double attitude_white_deg = 0.0;  // each sample, each axis

  double dvl_noise_mps = 0.0;  // each ensemble, x and y
  double dvl_scale = 0.0;  // constant relative error of the velocity: sound speed and calibration
  double dvl_misalignment_deg = 0.0;  // constant, about each axis
  double dvl_range_noise_m = 0.0;

  double depth_noise_m = 0.0;
  double depth_bias_m = 0.0;  // constant

  // The errors of a class. Throws std::invalid_argument with the names of the classes.
  //   ideal         no error at all: for tests
  //   ins_tactical  fibre-optic gyros that find north by themselves, 600 kHz DVL calibrated against
  //                 GPS (0.2 % of scale, 0.1 deg): 0.2 to 0.5 % of the distance from the origin
  //   mems          magnetic attitude sensor of 1 deg, DVL as delivered (0.5 %, 0.3 deg): 1 to 3 %
  static SensorErrors OfClass(const std::string& name);
  static std::vector<std::string> Classes();
  bool operator==(const SensorErrors&) const = default;

  // Heading sigma that the device states: root sum of squares of its attitude errors.
  double StatedHeadingSigmaDeg() const;
  double StatedRollPitchSigmaDeg() const;
};

}  // namespace seastitch::bench
