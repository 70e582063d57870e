#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/geo_point.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"

// Measurements of sensors, without filtering and without lever-arm correction, and states of
// navigation. SI units and radians. Axes are those of the sensor unless a name states others. A
// time is the instant of the measurement, UTC (docs/frames.md).
namespace seastitch {

// Limits of the sound speed in sea water, with a margin. A value beyond is an error of a sensor or
// of a file.
inline constexpr double kMinSoundSpeedMps = 1300.0;
inline constexpr double kMaxSoundSpeedMps = 1800.0;
constexpr bool IsSoundSpeed(double mps) {
  return mps >= kMinSoundSpeedMps && mps <= kMaxSoundSpeedMps;
}

// Attitude of a sensor. Yaw is from the north that the device uses: true, or magnetic (then
// navigation.magnetic_declination_deg is configured).
struct Attitude {
  Eigen::Quaterniond q_ned_imu = Eigen::Quaterniond::Identity();  // takes sensor axes to NED
  // Roll, pitch, yaw, 1 sigma; 0: not stated.
  Eigen::Vector3d sigma_rpy_rad = Eigen::Vector3d::Zero();
};

// Alignment state of an inertial unit: whether its heading is valid. kUnknown: not stated.
enum class HeadingAlignment : std::uint8_t { kUnknown, kAligning, kAligned };

struct ImuSample {
  Time time;
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();   // x forward, y right, z down
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  // at rest and level: (0, 0, -g)
  std::optional<Attitude> attitude;                               // if the device computes one
  HeadingAlignment alignment = HeadingAlignment::kUnknown;
};

struct DvlBeam {
  bool valid = false;
  double range_m = 0.0;  // slant range; 0 where not valid
  // Component of the instrument's velocity along the beam, positive towards the bottom; 0 where not
  // stated.
  double velocity_mps = 0.0;
  std::optional<double> quality{};  // 0 (worst) to 1 (best); all beams have it or none
};

struct DvlSample {
  Time time;                 // centre of the ping
  bool bottom_lock = false;  // false: velocity and sigma are zero and mean nothing
  // Of the instrument over ground, in its own axes (x forward, y right, z down, as mounted).
  Eigen::Vector3d v_dvl_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_v_mps = Eigen::Vector3d::Zero();  // 1 sigma per component; 0: not stated
  std::array<DvlBeam, 4> beams;
  std::optional<double> altitude_m;  // of the instrument above the bottom, as it states it
  // Error velocity: difference of the two vertical velocities that four beams measure, as the
  // device scales it. Only its magnitude is used.
  std::optional<double> error_velocity_mps;
};

// True if every beam has a quality.
bool HasQuality(const DvlSample& sample);

struct DepthSample {
  Time time;
  std::optional<double> pressure_pa;  // gauge
  double depth_m = 0.0;               // of the pressure port below the sea surface, positive down
  double sigma_m = 0.0;               // 1 sigma; 0: not stated
};

enum BeamFlag : std::uint8_t {
  kBeamValid = 1,      // the sonar itself calls it a usable bottom detection
  kBeamAmplitude = 2,  // found by amplitude
  kBeamPhase = 4,      // found by phase
};

// One detection of a multibeam. The direction of its ray is the intersection of the transmit cone
// (tx_tilt_rad about the transmit array) and the receive cone (rx_angle_rad about the receive
// array), each from the z axis of its array (x forward, y starboard, z down).
struct MbesBeam {
  float twtt_s = 0.0f;             // two-way travel time, from this beam's own transmit pulse
  float rx_angle_rad = 0.0f;       // receive angle, across track, positive to starboard
  float tx_tilt_rad = 0.0f;        // transmit angle, along track, positive forward
  float tx_delay_s = 0.0f;         // time of this beam's transmit pulse less that of the ping
  float depth_sigma_ratio = 0.0f;  // 1 sigma of depth divided by depth, by the sonar; 0: not stated
  float backscatter_db = 0.0f;     // as the sonar states it; not used
  std::uint8_t flags = 0;          // BeamFlag
  std::uint8_t tx_array = 0;       // index of the transmit array, for a sonar with several
};

// Upper limit of a travel time: outer beams in 11 km of water, 30 km long.
constexpr float kMaxTravelTime_s = 40.0f;

// True if all values are finite, times are 0 to kMaxTravelTime_s and angles within half a turn, so
// that the beam can be computed with. Whether it is a bottom detection is in its flags.
bool IsPlausible(const MbesBeam& beam);

struct MbesPing {
  Time time;                      // first transmit pulse
  std::uint32_t ping_number = 0;  // the device's counter
  double sound_speed_mps = 0.0;   // at the transducer, as the sonar used it
  std::vector<MbesBeam> beams;
  // Index of the head, for a sonar with several. Each head sends pings of its own; their times may
  // be equal.
  std::uint8_t head = 0;
};

// Time of the last echo of a ping, over its valid and plausible beams; the ping's time without any.
Time LastEcho(const MbesPing& ping);

// One detection as a point, for sources without travel times and angles.
struct LevelSounding {
  // Level frame of the vehicle at the ping's time (its heading, without roll and pitch): x forward,
  // y starboard, z down of the reference point [m].
  Eigen::Vector3f p_level_m = Eigen::Vector3f::Zero();
  float sigma_z_m = 0.0f;  // 1 sigma of z; 0 where not given
  std::uint8_t flags = 0;  // BeamFlag
};

struct SoundingPing {
  Time time;  // first transmit pulse
  std::uint32_t ping_number = 0;
  std::uint8_t head = 0;
  std::vector<LevelSounding> soundings;
};

// Time of the ping, since points have no travel times.
inline Time LastEcho(const SoundingPing& ping) { return ping.time; }

// Sound speed by depth below the sea surface; depths increase strictly.
struct SoundVelocityProfile {
  Time time;
  std::vector<double> depth_m;
  std::vector<double> speed_mps;
};

// Position of an antenna or transponder of the vehicle: VehicleGeometry::FixPointOf(source).
struct PositionFix : GeoPoint {
  Time time;
  Eigen::Matrix2d covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  std::string source;  // "gps", "usbl"
};

// Status of an INS, as it states it.
enum class InsStatus : std::uint8_t {
  kUnknown,
  kAligning,
  kDeadReckoning,  // without external position aiding
  kAided,          // with external position aiding
  kInvalid,
};

// Position as a source states it.
struct GeoPosition : GeoPoint {
  Eigen::Vector2d sigma_north_east_m = Eigen::Vector2d::Zero();  // 1 sigma; 0: not stated
};

// A vertical coordinate and its 1-sigma uncertainty.
struct InsVertical {
  double value_m = 0.0;
  double sigma_m = 0.0;  // 0 where the device states none
};

// Velocity over ground as a source states it: north, east, down.
struct GeoVelocity {
  Eigen::Vector3d v_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_ned_mps = Eigen::Vector3d::Zero();  // 1 sigma; 0: not stated
};

// Navigation solution of an INS. Position, depth, height and velocity are those of its measuring
// point; attitude is that of its axes (x forward, y starboard, z down).
struct NavigationSample {
  Time time;
  InsStatus status = InsStatus::kUnknown;
  std::optional<GeoPosition> position;
  std::optional<InsVertical> depth;   // below the water line, positive down
  std::optional<InsVertical> height;  // above the WGS 84 ellipsoid
  std::optional<Attitude> attitude;
  std::optional<GeoVelocity> velocity;
  std::string source;  // "phins", "kmall"
};

// Dead-reckoned state of the vehicle's reference point (message NAV).
struct NavState {
  Time time;
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
  // Covariance of the errors of north, east, down [m], then roll, pitch, yaw [rad], in the map.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  bool bottom_lock = false;
};

// x, y [m], yaw [rad] of the vehicle in the map: as they were given at that time, and as they are
// known later.
struct SmoothedPose {
  Time time;
  Pose2 given;
  Pose2 smoothed;
  Eigen::Vector2d v_map_mps = Eigen::Vector2d::Zero();  // smoothed
};

// State of the vehicle, corrected by the pose graph (message NAV_CORRECTED).
struct CorrectedNavState {
  NavState state;  // corrected, at the newest inertial or INS sample
  // The correction: takes a dead-reckoned pose (in the map as NAV has it) to the corrected map.
  Pose2 T_map_nav;
  std::int64_t graph_version = 0;  // of the solution that the correction comes from; 0: none yet
  std::int64_t jumps = 0;          // number of changes of the correction
  double last_jump_m = 0.0;        // horizontal displacement of the vehicle by the last change
  double last_jump_yaw_rad = 0.0;  // change of its yaw by the last change
};

}  // namespace seastitch
