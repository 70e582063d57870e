#pragma once

#include <Eigen/Core>
#include <string>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// A first-order Gauss-Markov error: `sigma` when left alone, forgotten over `tau_s`.
template <class T>
struct GaussMarkov {
  T sigma;
  double tau_s;
};

// What the data sheets say of the sensors, and the limits beyond which a sample is refused.
// Defaults: an SBG-class INS on CAN and a 600 kHz DVL.
struct NavigationParams {
  // Inertial unit: white noise as a density, then the coarsest step in which its bus carries the
  // value (SBG ECAN: 0.001 rad/s, 0.01 m/s2; zero where it carries floats). A slowly turning
  // vehicle keeps the rounding error for as long as step_correlation_s, so it counts for more than
  // one sample's worth of white noise.
  double gyro_noise_radps_rthz = 5e-5;  // 0.17 deg/sqrt(h)
  double accel_noise_mps2_rthz = 1e-3;  // 100 ug/sqrt(Hz), hull vibration included
  double gyro_step_radps = 0.0;
  double accel_step_mps2 = 0.0;
  double step_correlation_s = 0.1;  // time in which attitude motion crosses a step
  GaussMarkov<double> gyro_bias_radps{5e-4, 3600.0};  // 100 deg/h turn-on, each axis
  GaussMarkov<double> accel_bias_mps2{2e-2, 3600.0};  // 2 mg, each axis

  // Attitude of the device (roll, pitch, yaw). Its error is nearly constant for minutes, so it is a
  // state and not noise: counted as white, 0.4 degrees at 10 Hz would soon look like 0.01. Where
  // the device states a larger sigma than this, the device's holds.
  GaussMarkov<Eigen::Vector2d> attitude_roll_pitch_rad{{Deg2Rad(0.05), Deg2Rad(0.05)}, 1800.0};
  GaussMarkov<double> attitude_heading_rad{Deg2Rad(0.4), 3600.0};
  // What a magnetic heading does beside that (0: none): it wanders over minutes, and it deviates by
  // the sine and the cosine of the heading, as what is left of the vehicle's own magnetism does.
  GaussMarkov<double> attitude_heading_wander_rad{0.0, 300.0};
  double attitude_deviation_rad = 0.0;  // sigma of either
  Eigen::Vector3d attitude_white_rad{Deg2Rad(0.02), Deg2Rad(0.02), Deg2Rad(0.05)};  // a sample
  double attitude_interval_s = 0.1;  // used no more often: its noise is not white above 10 Hz

  // East positive: what a magnetic heading lacks of a true one, in that year (2026.5 is its
  // middle).
  double declination_rad = 0.0;
  double declination_year = 2026.0;
  double declination_rad_per_year = 0.0;

  // Added to the stamp of every attitude, and by how much that may still be wrong.
  double attitude_time_offset_s = 0.0;
  double attitude_time_sigma_s = 0.003;
  // A device that steps so soon after the start was aligning, and is right now; later, it is held
  // to be wrong until it steps back.
  double attitude_settle_s = 180.0;

  // DVL bottom track. scale: sound speed at the instrument and the maker's own; mounting: what is
  // left after calibration, about each of its axes.
  double dvl_sigma_mps = 0.01;         // where the sample states none
  double dvl_sigma_floor_mps = 0.005;  // nobody is better
  GaussMarkov<double> dvl_scale{3e-3, 36000.0};
  GaussMarkov<double> dvl_mounting_rad{Deg2Rad(0.2), 360000.0};
  // The speed of sound that the instrument reckons with: its velocities are true to the speed that
  // the sonar measures over this one. 0: it knows the speed by itself, or its beams are formed by a
  // flat phased array, for which horizontal velocity does not depend on it.
  double dvl_sound_speed_mps = 0.0;
  double bottom_lock_timeout_s = 2.0;  // without an accepted ensemble for so long, lock is lost

  double dvl_time_offset_s = 0.0;           // added to the stamp of every ensemble
  double dvl_time_sigma_s = 0.005;          // by how much that may still be wrong
  double dvl_max_error_velocity_mps = 0.3;  // beyond, the beams do not see the same bottom
  // A DVL that has stepped without an acceleration is not used for so long, nor while the filter
  // still knows the velocity better.
  double dvl_step_s = 40.0;

  // Of the vehicle, by its data sheet: over ground, current included. No state is faster.
  double max_speed_mps = 6.0;
  double max_acceleration_mps2 = 10.0;

  double depth_sigma_m = 0.02;                      // where the sample states none
  double depth_sigma_floor_m = 0.01;                // waves and the port's own flow noise
  GaussMarkov<double> depth_bias_m{0.02, 36000.0};  // the sensor's own, and the air's pressure

  // A component further off than this many of its own sigmas is refused. 4: one in 16,000 good
  // ones.
  double gate_sigma = 4.0;
  // A sensor refused for so long is right and the filter wrong: what it measures is opened anew.
  double gate_reset_s = 5.0;

  // Where the dive starts: a stated place, or the first position fix, which is waited for
  // start_wait_s; without one, at the datum with its place unknown by 1 km.
  bool start_at_first_fix = false;
  double start_north_m = 0.0;  // in the map
  double start_east_m = 0.0;
  double start_sigma_m = 1.0;
  // After the start: true, the filter takes them; false, DeadReckoning::TakeFixes() gives them.
  bool fuse_position_fixes = false;
  double fix_interval_s = 10.0;  // used no more often: their errors are not white
  // Attitude, depth and bottom lock are waited for so long; then the start is made without depth
  // or velocity, and says so in its covariance. Attitude is always needed.
  double start_wait_s = 10.0;
  double start_heading_sigma_rad = Deg2Rad(20.0);  // a device that states more is waited for
  double start_speed_sigma_mps = 1.5;
  double start_depth_sigma_m = 5.0;

  // Samples are put into order of time within this window; those that come later are counted.
  double reorder_window_s = 0.5;
  // Above this gap between inertial samples the motion is not integrated but guessed: straight on,
  // with coast_speed_sigma_mps of doubt.
  double imu_gap_s = 0.2;
  double coast_speed_sigma_mps = 1.0;
  // A stamp that leaps forward by more than this is believed after so many in a row.
  double clock_jump_s = 1.0;
  int clock_jump_samples = 50;

  // What is kept: poses at the rate of the inertial unit for the pings that wait, at
  // epoch_interval_s for anyone else, and the transition of the error at key_interval_s for
  // RelativeCovariance(). 40 minutes are two of the longest submaps; 11 kB a second of memory.
  double pose_window_s = 120.0;
  double window_s = 2400.0;
  double epoch_interval_s = 0.1;
  double key_interval_s = 1.0;
};

// For whoever makes them in code: std::invalid_argument names what no filter can work with. What
// files say is checked where it is read.
void CheckParams(const NavigationParams& params);

// At that time, by the yearly change.
double DeclinationAt(const NavigationParams& params, Time t);

// How far east or west of the datum the meridians have turned by as much as the heading sensor's
// sigma: dead reckoning takes north for the datum's north everywhere.
double ConvergenceLimitM(const NavigationParams& params, double datum_latitude_rad);

// The same in words, with what the transport rate may be.
std::string NorthSentence(const NavigationParams& params, double datum_latitude_rad);

}  // namespace seastitch
