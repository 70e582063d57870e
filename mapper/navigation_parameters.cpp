// The section `navigation` of config/mapper.yaml.

#include "common/core/sound_speed.hpp"
#include "mapper/mapper_config.hpp"

namespace seastitch {
namespace {

const Range kPositive = Range::Above(0.0);
const Range kNotNegative = Range::AtLeast(0.0);
const Range kTimeOffset = Range::Within(-5.0, 5.0);

using enum Unit;

void DeclareInertialUnit(NavigationParams* p, ParameterTable* t) {
  t->Add("gyro_noise_radps_rthz",
         &p->gyro_noise_radps_rthz,
         kRadianPerSecondRootHertz,
         kPositive,
         "Angular random walk: white noise of a gyro as a density. 5e-5 is 0.17 deg/sqrt(h).")
      .DataSheet();
  t->Add("gyro_bias_radps",
         &p->gyro_bias_radps.sigma,
         kRadianPerSecond,
         kPositive,
         "Bias of a gyro from turn-on to turn-on, 1 sigma. 5e-4 is 100 deg/h.")
      .DataSheet();
  t->Add("gyro_bias_tau_s",
         &p->gyro_bias_radps.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the gyro bias.");
  t->Add("accel_noise_mps2_rthz",
         &p->accel_noise_mps2_rthz,
         kMetrePerSecond2RootHertz,
         kPositive,
         "White noise of an accelerometer as a density, hull vibration included. 1e-3 is 100 "
         "ug/sqrt(Hz).")
      .DataSheet();
  t->Add("accel_bias_mps2",
         &p->accel_bias_mps2.sigma,
         kMetrePerSecond2,
         kPositive,
         "Bias of an accelerometer, 1 sigma. 2e-2 is 2 mg.")
      .DataSheet();
  t->Add("accel_bias_tau_s",
         &p->accel_bias_mps2.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the accelerometer bias.");
  t->Add("gyro_resolution_radps",
         &p->gyro_step_radps,
         kRadianPerSecond,
         kNotNegative,
         "Step in which the bus carries the angular rate: 0.001 for SBG ECAN; 0: it carries "
         "floats.")
      .WasCalled("gyro_step_radps");
  t->Add("accel_resolution_mps2",
         &p->accel_step_mps2,
         kMetrePerSecond2,
         kNotNegative,
         "Step in which the bus carries the specific force: 0.01 for SBG ECAN.")
      .WasCalled("accel_step_mps2");
  t->Add("resolution_correlation_s",
         &p->step_correlation_s,
         kSecond,
         kNotNegative,
         "A slowly turning vehicle keeps one rounding error for this long.")
      .WasCalled("step_correlation_s");
}

void DeclareAttitude(NavigationParams* p, ParameterTable* t) {
  t->Add("attitude_roll_pitch_deg",
         &p->attitude_roll_pitch_rad.sigma,
         kDegreeFromRadian,
         kPositive,
         "Error of the unit's roll and pitch that stays for minutes, 1 sigma. Where the device "
         "states a larger sigma, the device's holds; so for heading.")
      .DataSheet();
  t->Add("attitude_roll_pitch_tau_s",
         &p->attitude_roll_pitch_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the error of roll and pitch.");
  t->Add("attitude_heading_deg",
         &p->attitude_heading_rad.sigma,
         kDegreeFromRadian,
         kPositive,
         "Error of the unit's heading that stays for minutes, 1 sigma.")
      .DataSheet();
  t->Add("attitude_heading_tau_s",
         &p->attitude_heading_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the error of heading.");
  t->Add("attitude_heading_wander_deg",
         &p->attitude_heading_wander_rad.sigma,
         kDegreeFromRadian,
         kNotNegative,
         "Second, faster error of heading, as magnetic ones have, 1 sigma.");
  t->Add("attitude_heading_wander_tau_s",
         &p->attitude_heading_wander_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the second error of heading.");
  t->Add("attitude_heading_deviation_deg",
         &p->attitude_deviation_rad,
         kDegreeFromRadian,
         kNotNegative,
         "Compass deviation with the sine and the cosine of the heading, 1 sigma of either.")
      .WasCalled("attitude_deviation_deg");
  t->Add("attitude_noise_deg",
         &p->attitude_white_rad,
         kDegreeFromRadian,
         kPositive,
         "Noise of roll, pitch and heading, new in each sample, 1 sigma.")
      .WasCalled("attitude_white_deg");
  t->Add("attitude_interval_s",
         &p->attitude_interval_s,
         kSecond,
         kPositive,
         "Attitude is used no more often: its noise is not white above 10 Hz.");
  t->Add("magnetic_declination_deg",
         &p->declination_rad,
         kDegreeFromRadian,
         Range::Within(-180.0, 180.0),
         "Added to the unit's heading where that is magnetic, east positive: of the place, in "
         "magnetic_declination_year. 0: the heading is true, or the unit adds it itself.")
      .DataSheet();
  t->Add("magnetic_declination_year",
         &p->declination_year,
         kNone,
         Range::Within(1900.0, 2200.0),
         "When it has that value, as a decimal year: 2026.5 is the middle of 2026.")
      .DataSheet();
  t->Add("magnetic_declination_yearly_deg",
         &p->declination_rad_per_year,
         kDegreeFromRadian,
         Range::Within(-5.0, 5.0),
         "By how much the declination grows in a year.")
      .DataSheet();
  t->Add("attitude_time_offset_s",
         &p->attitude_time_offset_s,
         kSecond,
         kTimeOffset,
         "Added to the stamp of every attitude.")
      .DataSheet();
  t->Add("attitude_time_sigma_s",
         &p->attitude_time_sigma_s,
         kSecond,
         kNotNegative,
         "Error of that stamp, 1 sigma. Its effect is the rate of turn times this.");
  t->Add("attitude_settle_s",
         &p->attitude_settle_s,
         kSecond,
         kNotNegative,
         "A heading that steps this soon after the start was aligning and is right from then on; "
         "one that steps later is refused until it steps back.");
}

void DeclareDopplerLog(NavigationParams* p, ParameterTable* t) {
  t->Add("dvl_sigma_mps",
         &p->dvl_sigma_mps,
         kMetrePerSecond,
         kPositive,
         "Noise of the Doppler log's velocity, 1 sigma, where the device states none.")
      .DataSheet();
  t->Add("dvl_sigma_min_mps",
         &p->dvl_sigma_floor_mps,
         kMetrePerSecond,
         kPositive,
         "No smaller sigma is used, whatever the device states.")
      .WasCalled("dvl_sigma_floor_mps");
  t->Add("dvl_scale",
         &p->dvl_scale.sigma,
         kNone,
         kPositive,
         "Scale error of the Doppler log, 1 sigma: sound speed at the instrument, and the maker's "
         "own.")
      .DataSheet();
  t->Add("dvl_scale_tau_s",
         &p->dvl_scale.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the scale error.");
  t->Add("dvl_mounting_deg",
         &p->dvl_mounting_rad.sigma,
         kDegreeFromRadian,
         kPositive,
         "Misalignment of the Doppler log after calibration, each axis, 1 sigma.")
      .DataSheet();
  t->Add("dvl_mounting_tau_s",
         &p->dvl_mounting_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the misalignment.");
  t->Add("dvl_sound_speed_mps",
         &p->dvl_sound_speed_mps,
         kMetrePerSecond,
         Range::Within(kMinSoundSpeedMps, kMaxSoundSpeedMps).OrZero(),
         "Sound speed that the log is set to, corrected by the sonar's; 0: it measures its own, or "
         "is a flat phased array.");
  t->Add("bottom_lock_timeout_s",
         &p->bottom_lock_timeout_s,
         kSecond,
         kPositive,
         "Without an accepted ensemble for this long, bottom lock is lost.");
  t->Add("dvl_time_offset_s",
         &p->dvl_time_offset_s,
         kSecond,
         kTimeOffset,
         "Added to the stamp of every ensemble.")
      .DataSheet();
  t->Add("dvl_time_sigma_s",
         &p->dvl_time_sigma_s,
         kSecond,
         kNotNegative,
         "Error of that stamp, 1 sigma. Its effect is the acceleration times this.");
  t->Add("dvl_max_error_velocity_mps",
         &p->dvl_max_error_velocity_mps,
         kMetrePerSecond,
         kPositive,
         "An ensemble with a larger error velocity is refused: its beams see different bottoms.");
  t->Add(
      "dvl_step_s",
      &p->dvl_step_s,
      kSecond,
      kPositive,
      "A velocity that steps without an acceleration is refused for this long, or until it steps "
      "back.");
}

void DeclareVehicleLimits(NavigationParams* p, ParameterTable* t) {
  t->Add("max_speed_mps",
         &p->max_speed_mps,
         kMetrePerSecond,
         kPositive,
         "Largest speed of the vehicle over ground, current included. No state is faster.")
      .DataSheet();
  t->Add("max_acceleration_mps2",
         &p->max_acceleration_mps2,
         kMetrePerSecond2,
         kPositive,
         "Largest acceleration of the vehicle. A larger one is a fault of a sensor.")
      .DataSheet();
}

void DeclareDepth(NavigationParams* p, ParameterTable* t) {
  t->Add("depth_sigma_m",
         &p->depth_sigma_m,
         kMetre,
         kPositive,
         "Noise of the depth sensor, 1 sigma, where the device states none.")
      .DataSheet();
  t->Add("depth_sigma_min_m",
         &p->depth_sigma_floor_m,
         kMetre,
         kPositive,
         "No smaller sigma is used: waves, and the flow at the port.")
      .WasCalled("depth_sigma_floor_m");
  t->Add("depth_bias_m",
         &p->depth_bias_m.sigma,
         kMetre,
         kNotNegative,
         "Bias of depth, 1 sigma: the sensor's own, and the air's pressure.");
  t->Add("depth_bias_tau_s",
         &p->depth_bias_m.tau_s,
         kSecond,
         kPositive,
         "Correlation time of the depth bias.");
}

void DeclareGates(NavigationParams* p, ParameterTable* t) {
  t->Add("gate_sigma",
         &p->gate_sigma,
         kNone,
         kPositive,
         "Innovation gate: further off than this many sigma is refused; 4 refuses 1 in 16,000 good "
         "ones.");
  t->Add("gate_reset_s",
         &p->gate_reset_s,
         kSecond,
         kPositive,
         "A sensor refused for this long is right and the filter wrong: it starts anew.");
}

void DeclareStart(NavigationParams* p, ParameterTable* t) {
  t->Add("start_at_first_fix",
         &p->start_at_first_fix,
         "True: the dive starts at its first position fix, which is waited for start_wait_s; "
         "without one it starts at the datum with its place unknown (HEALTH: degraded), and any "
         "later fix places the whole map. False: it starts at the place given here.");
  const Parameter& north =
      t->Add("start_north_m", &p->start_north_m, kMetre, Range::Any(), "Stated start, in the map.");
  t->AddRule(north, "0 where start_at_first_fix is true", [p] {
    return !p->start_at_first_fix || p->start_north_m == 0.0;
  });
  const Parameter& east =
      t->Add("start_east_m", &p->start_east_m, kMetre, Range::Any(), "Stated start, in the map.");
  t->AddRule(east, "0 where start_at_first_fix is true", [p] {
    return !p->start_at_first_fix || p->start_east_m == 0.0;
  });
  t->Add("start_sigma_m", &p->start_sigma_m, kMetre, kPositive, "Of that start, 1 sigma.");
  t->Add("fuse_position_fixes",
         &p->fuse_position_fixes,
         "After the start a fix counts once. False: in the pose graph, which weighs it against all "
         "else and moves the whole map; true: in dead reckoning, so that NAV follows it at once.");
  t->Add("fix_interval_s",
         &p->fix_interval_s,
         kSecond,
         kNotNegative,
         "Fixes are used no more often: errors of neighbouring ones are alike.");
  t->Add("start_wait_s",
         &p->start_wait_s,
         kSecond,
         kPositive,
         "Depth, bottom lock and the first position fix are waited for this long once there is "
         "attitude.");
  t->Add("start_heading_sigma_deg",
         &p->start_heading_sigma_rad,
         kDegreeFromRadian,
         kPositive,
         "A device that states a larger sigma of its heading is waited for.");
  t->Add("start_speed_sigma_mps",
         &p->start_speed_sigma_mps,
         kMetrePerSecond,
         kPositive,
         "Of the velocity at the start, where bottom lock did not come, 1 sigma.");
  t->Add("start_depth_sigma_m",
         &p->start_depth_sigma_m,
         kMetre,
         kPositive,
         "Of the depth at the start, where none came, 1 sigma.");
}

void DeclareTime(NavigationParams* p, ParameterTable* t) {
  t->Add("reorder_window_s",
         &p->reorder_window_s,
         kSecond,
         kNotNegative,
         "Samples are put into order within this window; later ones are counted.");
  t->Add("imu_gap_s",
         &p->imu_gap_s,
         kSecond,
         Range::Above(0.0).AtMost(1.0),
         "Beyond this gap between inertial samples the motion is not integrated but guessed.");
  t->Add("coast_speed_sigma_mps",
         &p->coast_speed_sigma_mps,
         kMetrePerSecond,
         kPositive,
         "Of the velocity in such a gap, 1 sigma.");
  const Parameter& jump = t->Add("clock_jump_s",
                                 &p->clock_jump_s,
                                 kSecond,
                                 Range::Above(0.0).AtMost(60.0),
                                 "A leap forward by more is a jump of the clock after ...");
  t->AddRule(jump, "above reorder_window_s", [p] { return p->clock_jump_s > p->reorder_window_s; });
  t->Add("clock_jump_samples",
         &p->clock_jump_samples,
         kNone,
         Range::AtLeast(2),
         "... this many samples in a row.");
}

void DeclareHistory(NavigationParams* p, ParameterTable* t) {
  t->Add("pose_history_s",
         &p->pose_window_s,
         kSecond,
         Range::Within(1.0, 3600.0),
         "Poses kept at the full rate, for pings that wait.")
      .WasCalled("pose_window_s");
  const Parameter& history =
      t->Add("history_s",
             &p->window_s,
             kSecond,
             Range::Within(1.0, 36'000.0),
             "Poses and transitions kept for covariances between submaps; 11 kB a second.")
          .WasCalled("window_s");
  t->AddRule(history, "at least pose_history_s", [p] { return p->window_s >= p->pose_window_s; });
  t->Add("epoch_interval_s",
         &p->epoch_interval_s,
         kSecond,
         Range::Within(0.01, 60.0),
         "Between the poses that are kept beyond pose_history_s.");
  t->Add("key_interval_s",
         &p->key_interval_s,
         kSecond,
         Range::Within(0.01, 60.0),
         "Between the transitions of the error that are kept.");
}

}  // namespace

void DeclareNavigation(NavigationParams* params, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "navigation", "What the data sheets state of the sensors (1 sigma), and dead reckoning.");
  DeclareInertialUnit(params, &section);
  DeclareAttitude(params, &section);
  DeclareDopplerLog(params, &section);
  DeclareVehicleLimits(params, &section);
  DeclareDepth(params, &section);
  DeclareGates(params, &section);
  DeclareStart(params, &section);
  DeclareTime(params, &section);
  DeclareHistory(params, &section);
}

}  // namespace seastitch
