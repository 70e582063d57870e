#pragma once

#include <Eigen/Core>
#include <string>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "common/parameters/parameters.hpp"

namespace seastitch {

// First-order Gauss-Markov error: steady-state sigma and correlation time.
template <class T>
struct GaussMarkov {
  T sigma;
  double tau_s;
};

// Errors of the sensors (1 sigma, from their data sheets), and limits beyond which a sample is
// refused. Defaults: an SBG-class INS on CAN and a 600 kHz DVL. The keys of the configuration are
// in mapper/navigation_parameters.cpp.
struct NavigationParams {
  // Inertial unit: white noise as a density, then the quantisation step of its bus (SBG ECAN: 0.001
  // rad/s, 0.01 m/s2; 0: floats). The rounding errors of a slowly turning vehicle are correlated
  // over step_correlation_s, and count for more than one sample's white noise.
  double gyro_noise_radps_rthz = 5e-5;  // 0.17 deg/sqrt(h)
  double accel_noise_mps2_rthz = 1e-3;  // 100 ug/sqrt(Hz), hull vibration included
  double gyro_step_radps = 0.0;
  double accel_step_mps2 = 0.0;
  double step_correlation_s = 0.1;  // time in which attitude motion crosses a step
  GaussMarkov<double> gyro_bias_radps{5e-4, 3600.0};  // 100 deg/h turn-on, each axis
  GaussMarkov<double> accel_bias_mps2{2e-2, 3600.0};  // 2 mg, each axis

  // Attitude of the device (roll, pitch, yaw). Its error varies slowly, so that it is a state and
  // not white noise: as white noise, 0.4 degrees at 10 Hz would soon average to 0.01. Where the
  // device states a larger sigma than this, the larger one is used.
  GaussMarkov<Eigen::Vector2d> attitude_roll_pitch_rad{{Deg2Rad(0.05), Deg2Rad(0.05)}, 1800.0};
  GaussMarkov<double> attitude_heading_rad{Deg2Rad(0.4), 3600.0};
  // Further errors of a magnetic heading (0: none): a wander within minutes, and a deviation by the
  // sine and the cosine of heading, from magnetism of the vehicle that calibration left.
  GaussMarkov<double> attitude_heading_wander_rad{0.0, 300.0};
  double attitude_deviation_rad = 0.0;  // 1 sigma of each coefficient
  // White noise of a sample: roll, pitch, yaw.
  Eigen::Vector3d attitude_white_rad{Deg2Rad(0.02), Deg2Rad(0.02), Deg2Rad(0.05)};
  double attitude_interval_s = 0.1;  // shortest interval: above 10 Hz the noise is not white

  // Magnetic declination, true minus magnetic heading, east positive, in that decimal year.
  double declination_rad = 0.0;
  double declination_year = 2026.0;
  double declination_rad_per_year = 0.0;

  // Added to the stamp of every attitude (negative: stamps are late), and 1 sigma of what remains.
  double attitude_time_offset_s = 0.0;
  double attitude_time_sigma_s = 0.003;
  // Time after the start within which a step of heading is the device's alignment, and followed. A
  // later step is not followed, unless position fixes confirm it.
  double attitude_settle_s = 180.0;

  // DVL bottom track. scale: error by sound speed at the instrument and by its calibration.
  // mounting: misalignment after calibration, about each of its axes.
  double dvl_sigma_mps = 0.01;         // where the sample states none
  double dvl_sigma_floor_mps = 0.005;  // lower bound, whatever the sample states
  GaussMarkov<double> dvl_scale{3e-3, 36000.0};
  GaussMarkov<double> dvl_mounting_rad{Deg2Rad(0.2), 360000.0};
  // Sound speed that the instrument is set to: velocities are multiplied by the speed that the
  // sonar measures divided by this one. 0: the instrument measures the speed itself, or has a flat
  // phased array, whose horizontal velocity does not depend on it.
  double dvl_sound_speed_mps = 0.0;
  double bottom_lock_timeout_s = 2.0;  // time without an accepted ensemble until lock is lost

  double dvl_time_offset_s = 0.0;   // added to the stamp of every ensemble; negative: it is late
  double dvl_time_sigma_s = 0.005;  // 1 sigma of what remains
  double dvl_max_error_velocity_mps = 0.3;  // beyond, the beams do not see the same bottom
  // Shortest time for which a DVL that stepped without an acceleration is not used. After it, it is
  // not used while the filter knows velocity better than the step.
  double dvl_step_s = 40.0;

  // Largest speed over ground, current included, and largest acceleration of the vehicle.
  double max_speed_mps = 6.0;
  double max_acceleration_mps2 = 10.0;

  double depth_sigma_m = 0.02;                      // where the sample states none
  double depth_sigma_floor_m = 0.01;                // waves, and flow at the pressure port
  GaussMarkov<double> depth_bias_m{0.02, 36000.0};  // the sensor's own, and air pressure

  // Innovation gate: a component farther off than this many sigma is refused. 4 refuses 1 good one
  // in 16,000.
  double gate_sigma = 4.0;
  // Time after which a sensor that is refused without a break is taken to be right: the state is
  // reset to its measurement.
  double gate_reset_s = 5.0;

  // Start position: a configured place; or the first position fix, after a wait of start_wait_s at
  // most; without one, the datum with a sigma of 1 km.
  bool start_at_first_fix = false;
  double start_north_m = 0.0;  // in the map
  double start_east_m = 0.0;
  double start_sigma_m = 1.0;
  // Fixes after the start. True: the filter uses them. False: DeadReckoning::TakeFixes() returns
  // them for the graph.
  bool fuse_position_fixes = false;
  double fix_interval_s = 10.0;  // shortest interval per source: errors are correlated
  // Longest wait for depth, bottom lock and the first fix once there is attitude. Then the start is
  // made without them, with the sigmas below. Attitude is always needed.
  double start_wait_s = 10.0;
  double start_heading_sigma_rad = Deg2Rad(20.0);  // waits while the device states a larger one
  double start_speed_sigma_mps = 1.5;
  double start_depth_sigma_m = 5.0;

  // Time for which samples wait, to be used in order of their stamps. Later ones are counted.
  double reorder_window_s = 0.5;
  // Longest gap between inertial samples that is integrated. Over a longer one the velocity is
  // extrapolated, with a sigma of coast_speed_sigma_mps.
  double imu_gap_s = 0.2;
  double coast_speed_sigma_mps = 1.0;
  // Inertial stamps ahead by more than clock_jump_s are followed after clock_jump_samples in a row,
  // or after 0.3 s, of a slow unit too.
  double clock_jump_s = 1.0;
  int clock_jump_samples = 50;

  // History: poses at the inertial unit's rate for pose_window_s (pings that wait); for window_s,
  // poses at epoch_interval_s and transition matrices of the error at key_interval_s, for
  // RelativeCovariance(). 40 minutes are more than two of the longest submaps; 11 kB per second.
  double pose_window_s = 120.0;
  double window_s = 2400.0;
  double epoch_interval_s = 0.1;
  double key_interval_s = 1.0;
};

// Declares the section `navigation` of config/mapper.yaml.
void DeclareNavigation(NavigationParams* params, ParameterTable* table);

// Checks parameters that were set in code, by their declaration. Throws std::invalid_argument.
void CheckParams(const NavigationParams& params);

// Magnetic declination [rad, east positive] at t, by the yearly change.
double DeclinationAt(const NavigationParams& params, Time t);

// Distance east or west of the datum [m] at which meridian convergence, which dead reckoning
// neglects, equals the heading sensor's sigma.
double ConvergenceLimitM(const NavigationParams& params, double datum_latitude_rad);

// The same in words, with the largest transport rate that is neglected.
std::string NorthSentence(const NavigationParams& params, double datum_latitude_rad);

}  // namespace seastitch
