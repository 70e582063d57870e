// The section `navigation` of config/mapper.yaml.

#include "common/core/sensors.hpp"
#include "mapper/navigation/navigation_params.hpp"

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
         "White noise of a gyro as a density (angular random walk). 5e-5 is 0.17 deg/sqrt(h).")
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
         "Quantisation step of the angular rate on the unit's bus: 0.001 for SBG ECAN. 0: the bus "
         "carries floats.");
  t->Add("accel_resolution_mps2",
         &p->accel_step_mps2,
         kMetrePerSecond2,
         kNotNegative,
         "Quantisation step of the specific force on the unit's bus: 0.01 for SBG ECAN. 0: the bus "
         "carries floats.");
  t->Add("resolution_correlation_s",
         &p->step_correlation_s,
         kSecond,
         kNotNegative,
         "Correlation time of the rounding errors: for so long a slowly turning vehicle stays "
         "within one quantisation step. Without effect where both steps are 0.");
}

void DeclareAttitude(NavigationParams* p, ParameterTable* t) {
  t->Add("attitude_roll_pitch_deg",
         &p->attitude_roll_pitch_rad.sigma,
         kDegreeFromRadian,
         kPositive,
         "Slowly varying error of the unit's roll and pitch (attitude_roll_pitch_tau_s), 1 sigma: "
         "the data sheet's accuracy. Where the unit states a larger sigma, the larger one is used.")
      .DataSheet();
  t->Add("attitude_roll_pitch_tau_s",
         &p->attitude_roll_pitch_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of attitude_roll_pitch_deg.");
  t->Add("attitude_heading_deg",
         &p->attitude_heading_rad.sigma,
         kDegreeFromRadian,
         kPositive,
         "Slowly varying error of the unit's heading (attitude_heading_tau_s), nearly constant "
         "from line to line, 1 sigma: the data sheet's accuracy. Where the unit states a larger "
         "sigma, the larger one is used.")
      .DataSheet();
  t->Add("attitude_heading_tau_s",
         &p->attitude_heading_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of attitude_heading_deg.");
  t->Add("attitude_heading_wander_deg",
         &p->attitude_heading_wander_rad.sigma,
         kDegreeFromRadian,
         kNotNegative,
         "Second error of the unit's heading, which wanders within minutes, 1 sigma: for magnetic "
         "compasses. 0 for units that find north by gyros.");
  t->Add("attitude_heading_wander_tau_s",
         &p->attitude_heading_wander_rad.tau_s,
         kSecond,
         kPositive,
         "Correlation time of attitude_heading_wander_deg.");
  t->Add("attitude_heading_deviation_deg",
         &p->attitude_deviation_rad,
         kDegreeFromRadian,
         kNotNegative,
         "Compass deviation that calibration left: 1 sigma of its coefficients of the sine and of "
         "the cosine of heading. 0 for units without a compass.");
  t->Add("attitude_noise_deg",
         &p->attitude_white_rad,
         kDegreeFromRadian,
         kPositive,
         "White noise of roll, pitch and heading, independent in each sample, 1 sigma.");
  t->Add("attitude_interval_s",
         &p->attitude_interval_s,
         kSecond,
         kPositive,
         "Shortest time between two attitudes that are used. At more than 10 Hz their noise is not "
         "white.");
  t->Add("magnetic_declination_deg",
         &p->declination_rad,
         kDegreeFromRadian,
         Range::Within(-180.0, 180.0),
         "Magnetic declination at the survey's place in magnetic_declination_year, east positive. "
         "Added to the unit's heading. 0: the heading is true already.")
      .DataSheet();
  t->Add("magnetic_declination_year",
         &p->declination_year,
         kNone,
         Range::Within(1900.0, 2200.0),
         "Decimal year in which magnetic_declination_deg holds: 2026.5 is the middle of 2026.")
      .DataSheet();
  t->Add("magnetic_declination_yearly_deg",
         &p->declination_rad_per_year,
         kDegreeFromRadian,
         Range::Within(-5.0, 5.0),
         "Change of the declination per year, east positive.")
      .DataSheet();
  t->Add("attitude_time_offset_s",
         &p->attitude_time_offset_s,
         kSecond,
         kTimeOffset,
         "Added to the stamp of every attitude: negative where stamps are late. HEALTH and the "
         "report suggest a value where the stamps disagree with the gyros.")
      .DataSheet();
  t->Add("attitude_time_sigma_s",
         &p->attitude_time_sigma_s,
         kSecond,
         kNotNegative,
         "Error of the attitude's stamps that is left after attitude_time_offset_s, 1 sigma. It "
         "counts as noise of this times the rate of turn.");
  t->Add(
      "attitude_settle_s",
      &p->attitude_settle_s,
      kSecond,
      kNotNegative,
      "Time after the start of dead reckoning within which a step of the unit's heading is its "
      "alignment, and followed. A later step is not followed, unless position fixes confirm it.");
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
         "Lower bound of the Doppler log's noise, 1 sigma, whatever the device states.");
  t->Add("dvl_scale",
         &p->dvl_scale.sigma,
         kNone,
         kPositive,
         "Scale error of the Doppler log, 1 sigma, 0.003 is 0.3 %: from sound speed at the "
         "instrument and from its calibration.")
      .DataSheet();
  t->Add(
      "dvl_scale_tau_s", &p->dvl_scale.tau_s, kSecond, kPositive, "Correlation time of dvl_scale.");
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
         "Correlation time of dvl_mounting_deg.");
  t->Add("dvl_sound_speed_mps",
         &p->dvl_sound_speed_mps,
         kMetrePerSecond,
         Range::Within(kMinSoundSpeedMps, kMaxSoundSpeedMps).OrZero(),
         "Sound speed that the Doppler log is set to. Its velocities are multiplied by the sonar's "
         "sound speed divided by this. 0: the log measures sound speed itself, or is a flat phased "
         "array.");
  t->Add("bottom_lock_timeout_s",
         &p->bottom_lock_timeout_s,
         kSecond,
         kPositive,
         "Time without an accepted ensemble (velocity sample) of the Doppler log after which "
         "bottom lock counts as lost.");
  t->Add("dvl_time_offset_s",
         &p->dvl_time_offset_s,
         kSecond,
         kTimeOffset,
         "Added to the stamp of every ensemble of the Doppler log: negative where stamps are late. "
         "HEALTH and the report suggest a value where the stamps disagree with the accelerometers.")
      .DataSheet();
  t->Add("dvl_time_sigma_s",
         &p->dvl_time_sigma_s,
         kSecond,
         kNotNegative,
         "Error of the ensembles' stamps that is left after dvl_time_offset_s, 1 sigma. It counts "
         "as noise of this times the acceleration.");
  t->Add("dvl_max_error_velocity_mps",
         &p->dvl_max_error_velocity_mps,
         kMetrePerSecond,
         kPositive,
         "Largest error velocity (disagreement of the beams) of an ensemble. One above it is "
         "refused: its beams do not see the same bottom.");
  t->Add("dvl_step_s",
         &p->dvl_step_s,
         kSecond,
         kPositive,
         "Shortest time for which a velocity that steps without an acceleration is refused, unless "
         "it steps back. It stays refused while the filter's velocity sigma is below a third of "
         "the step, 300 s at most.");
}

void DeclareVehicleLimits(NavigationParams* p, ParameterTable* t) {
  t->Add("max_speed_mps",
         &p->max_speed_mps,
         kMetrePerSecond,
         kPositive,
         "Largest speed of the vehicle over ground, current included. The estimated speed is "
         "limited to it, and faster ensembles of the Doppler log are not used.")
      .DataSheet();
  t->Add("max_acceleration_mps2",
         &p->max_acceleration_mps2,
         kMetrePerSecond2,
         kPositive,
         "Largest acceleration of the vehicle. Larger ones of the accelerometers are not "
         "integrated: the velocity is held.")
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
         "Lower bound of the depth sensor's noise, 1 sigma, whatever the device states: waves, and "
         "flow at the pressure port.");
  t->Add("depth_bias_m",
         &p->depth_bias_m.sigma,
         kMetre,
         kNotNegative,
         "Bias of depth, 1 sigma: the sensor's own, and the change of air pressure.");
  t->Add("depth_bias_tau_s",
         &p->depth_bias_m.tau_s,
         kSecond,
         kPositive,
         "Correlation time of depth_bias_m.");
}

void DeclareGates(NavigationParams* p, ParameterTable* t) {
  t->Add("gate_sigma",
         &p->gate_sigma,
         kNone,
         kPositive,
         "Innovation gate: a measurement farther off than this many sigma is refused. 4 refuses 1 "
         "good one in 16,000.");
  t->Add("gate_reset_s",
         &p->gate_reset_s,
         kSecond,
         kPositive,
         "Time after which a sensor that is refused without a break is taken to be right: "
         "attitude, velocity or depth is reset to its measurement.");
}

void DeclareStart(NavigationParams* p, ParameterTable* t) {
  t->Add("start_at_first_fix",
         &p->start_at_first_fix,
         "True: dead reckoning starts at the first position fix, for which it waits start_wait_s. "
         "Without one it starts at the datum with 1 km of uncertainty (HEALTH: degraded), and any "
         "later fix places the whole map. False: it starts at start_north_m and start_east_m.");
  const Parameter& north =
      t->Add("start_north_m",
             &p->start_north_m,
             kMetre,
             Range::Any(),
             "Start position north of the map's origin, where start_at_first_fix is false.");
  t->AddRule(north, "0 where start_at_first_fix is true", [p] {
    return !p->start_at_first_fix || p->start_north_m == 0.0;
  });
  const Parameter& east =
      t->Add("start_east_m",
             &p->start_east_m,
             kMetre,
             Range::Any(),
             "Start position east of the map's origin, where start_at_first_fix is false.");
  t->AddRule(east, "0 where start_at_first_fix is true", [p] {
    return !p->start_at_first_fix || p->start_east_m == 0.0;
  });
  t->Add("start_sigma_m",
         &p->start_sigma_m,
         kMetre,
         kPositive,
         "Uncertainty of start_north_m and start_east_m, each, 1 sigma.");
  t->Add("fuse_position_fixes",
         &p->fuse_position_fixes,
         "Where a position fix is used after the start. False: in the pose graph, which weighs it "
         "against all other data and moves the whole map. True: in dead reckoning, so that NAV "
         "follows it at once, for a vehicle that steers by NAV.");
  t->Add("fix_interval_s",
         &p->fix_interval_s,
         kSecond,
         kNotNegative,
         "Shortest time between two position fixes of one source that are used: errors of "
         "neighbouring fixes are correlated.");
  t->Add("start_wait_s",
         &p->start_wait_s,
         kSecond,
         kPositive,
         "Longest wait for depth, bottom lock and the first position fix once there is attitude. "
         "Then dead reckoning starts without them.");
  t->Add("start_heading_sigma_deg",
         &p->start_heading_sigma_rad,
         kDegreeFromRadian,
         kPositive,
         "Largest sigma of heading stated by the unit with which dead reckoning starts. It waits "
         "without limit while the unit states a larger one.");
  t->Add("start_speed_sigma_mps",
         &p->start_speed_sigma_mps,
         kMetrePerSecond,
         kPositive,
         "Uncertainty of the velocity at a start without bottom lock, 1 sigma.");
  t->Add("start_depth_sigma_m",
         &p->start_depth_sigma_m,
         kMetre,
         kPositive,
         "Uncertainty of the depth at a start without a depth sample, 1 sigma.");
}

void DeclareTime(NavigationParams* p, ParameterTable* t) {
  t->Add("reorder_window_s",
         &p->reorder_window_s,
         kSecond,
         kNotNegative,
         "Time for which samples wait, to be used in order of their stamps. Later ones are counted "
         "and not used.");
  t->Add("imu_gap_s",
         &p->imu_gap_s,
         kSecond,
         Range::Above(0.0).AtMost(1.0),
         "Longest gap between inertial samples that is integrated. Over a longer one the velocity "
         "is extrapolated.");
  t->Add("coast_speed_sigma_mps",
         &p->coast_speed_sigma_mps,
         kMetrePerSecond,
         kPositive,
         "Uncertainty of the velocity that is extrapolated over such a gap, 1 sigma.");
  const Parameter& jump = t->Add(
      "clock_jump_s",
      &p->clock_jump_s,
      kSecond,
      Range::Above(0.0).AtMost(60.0),
      "Smallest step of a clock that is treated as one. A smaller step is a gap in the data.");
  t->AddRule(jump, "above reorder_window_s", [p] { return p->clock_jump_s > p->reorder_window_s; });
  t->Add("clock_jump_samples",
         &p->clock_jump_samples,
         kNone,
         Range::AtLeast(2),
         "Number of inertial samples in a row ahead by more than clock_jump_s after which dead "
         "reckoning follows them.");
}

void DeclareHistory(NavigationParams* p, ParameterTable* t) {
  t->Add("pose_history_s",
         &p->pose_window_s,
         kSecond,
         Range::Within(1.0, 3600.0),
         "Time for which poses are kept at the inertial unit's rate, for pings that wait.");
  const Parameter& history =
      t->Add("history_s",
             &p->window_s,
             kSecond,
             Range::Within(1.0, 36'000.0),
             "Time for which poses and transition matrices of the error are kept, for covariances "
             "between submaps and for late position fixes; 11 kB per second.");
  t->AddRule(history, "at least pose_history_s", [p] { return p->window_s >= p->pose_window_s; });
  t->Add("epoch_interval_s",
         &p->epoch_interval_s,
         kSecond,
         Range::Within(0.01, 60.0),
         "Interval of the poses that are kept for history_s.");
  t->Add("key_interval_s",
         &p->key_interval_s,
         kSecond,
         Range::Within(0.01, 60.0),
         "Interval of the transition matrices that are kept for history_s.");
}

}  // namespace

void DeclareNavigation(NavigationParams* params, ParameterTable* table) {
  ParameterTable& section = table->AddSection("navigation",
                                              "Errors of the sensors, 1 sigma, as the data sheets "
                                              "state them, and settings of dead reckoning.");
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

void CheckParams(const NavigationParams& params) {
  NavigationParams copy = params;
  ParameterTable table;
  DeclareNavigation(&copy, &table);
  table.Check();
}

}  // namespace seastitch
