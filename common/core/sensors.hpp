#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/time.hpp"

// What the devices said: no filter, no lever arm. SI and radians; sensor axes unless named.
namespace seastitch {

struct Attitude {
  Eigen::Quaterniond q_ned_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rpy_rad = Eigen::Vector3d::Zero();  // roll, pitch, yaw, 1 sigma
};

// Whether the device has found north.
enum class Alignment : std::uint8_t { kUnknown, kAligning, kAligned };

struct ImuSample {
  Time time;
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();   // x forward, y right, z down
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  // at rest and level: (0, 0, -g)
  std::optional<Attitude> attitude;                               // where the device computes one
  Alignment alignment = Alignment::kUnknown;
};

struct DvlBeam {
  bool valid = false;
  double range_m = 0.0;       // slant range
  double velocity_mps = 0.0;  // along the beam, positive towards the bottom; 0 where not given
  std::optional<double> quality{};  // 0 (worst) to 1 (best); all beams have it or none
};

struct DvlSample {
  Time time;                 // centre of the ping
  bool bottom_lock = false;  // false: velocity and sigma are zero and mean nothing
  Eigen::Vector3d v_dvl_mps = Eigen::Vector3d::Zero();    // over ground, x fwd, y right, z down
  Eigen::Vector3d sigma_v_mps = Eigen::Vector3d::Zero();  // 1 sigma a component
  std::array<DvlBeam, 4> beams;
  std::optional<double> altitude_m;  // vertical, above the bottom
  // Difference of the two vertical velocities that four beams give.
  std::optional<double> error_velocity_mps;
};

// Every beam has a quality.
bool HasQuality(const DvlSample& sample);

struct DepthSample {
  Time time;
  std::optional<double> pressure_pa;  // gauge
  double depth_m = 0.0;               // below the water line, positive down
  double sigma_m = 0.0;
};

enum BeamFlag : std::uint8_t {
  kBeamValid = 1,      // the sonar itself calls it a usable bottom detection
  kBeamAmplitude = 2,  // found by amplitude
  kBeamPhase = 4,      // found by phase
};

// One detection. Launch vector in sonar axes (x forward, y starboard, z down) from both angles.
struct MbesBeam {
  float twtt_s = 0.0f;             // two-way travel time, from this beam's own transmit pulse
  float rx_angle_rad = 0.0f;       // receive angle across, positive to starboard
  float tx_tilt_rad = 0.0f;        // transmit tilt along, positive forward
  float tx_delay_s = 0.0f;         // of this beam's pulse after the ping's utime
  float depth_sigma_ratio = 0.0f;  // the sonar's 1 sigma of depth as a part of depth; 0 = not given
  float backscatter_db = 0.0f;
  std::uint8_t flags = 0;     // BeamFlag
  std::uint8_t tx_array = 0;  // which transmit array lit the beam, where a sonar has several
};

// Longer than the echo of any seabed takes: 15 km of water.
constexpr float kMaxTravelTime_s = 20.0f;

// Every figure is finite and no time or angle is beyond what there is, so that it can be reckoned
// with. That says nothing about whether the beam found the bottom.
bool IsPlausible(const MbesBeam& beam);

struct MbesPing {
  Time time;                      // first transmit pulse
  std::uint32_t ping_number = 0;  // the device's counter
  double sound_speed_mps = 0.0;   // at the transducer
  std::vector<MbesBeam> beams;
  // Of a sonar with several heads; each sends a ping of its own, and their times may be equal.
  std::uint8_t head = 0;
};

// When the last bottom echo came, by the beams that are valid and plausible.
Time LastEcho(const MbesPing& ping);

// One detection as a point: where the source has no travel times and angles.
struct LevelSounding {
  // Level frame of the vehicle at the ping's time: x ahead, y starboard, z down from its origin
  // [m].
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

// Where the echoes have been placed already, the ping is over at its time.
inline Time LastEcho(const SoundingPing& ping) { return ping.time; }

// Depths strictly rising.
struct SoundVelocityProfile {
  Time time;
  std::vector<double> depth_m;
  std::vector<double> speed_mps;
};

struct PositionFix {
  Time time;
  double latitude_rad = 0.0;  // WGS 84
  double longitude_rad = 0.0;
  Eigen::Matrix2d covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  std::string source;  // "gps", "usbl"
};

// What an INS says of itself.
enum class InsStatus : std::uint8_t {
  kUnknown,
  kAligning,
  kDeadReckoning,  // without a position from outside
  kAided,
  kInvalid,
};

struct InsPosition {
  double latitude_rad = 0.0;  // WGS 84
  double longitude_rad = 0.0;
  Eigen::Vector2d sigma_north_east_m = Eigen::Vector2d::Zero();  // 0 where the device states none
};

// A vertical coordinate with one sigma; sigma 0 where the device states none.
struct InsVertical {
  double value_m = 0.0;
  double sigma_m = 0.0;
};

struct InsVelocity {
  Eigen::Vector3d v_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_ned_mps = Eigen::Vector3d::Zero();  // 0 where the device states none
};

// Navigation as an INS computed it, in its own axes (x forward, y starboard, z down).
struct NavigationSample {
  Time time;
  InsStatus status = InsStatus::kUnknown;
  std::optional<InsPosition> position;
  std::optional<InsVertical> depth;   // below the water line, positive down
  std::optional<InsVertical> height;  // above the WGS 84 ellipsoid
  std::optional<Attitude> attitude;
  std::optional<InsVelocity> velocity;
  std::string source;  // "phins", "kmall"
};

// Dead-reckoned state of the vehicle.
struct NavState {
  Time time;
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
  // north, east, down [m], then roll, pitch, yaw [rad].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  bool bottom_lock = false;
};

// State of the vehicle in the solved map.
struct CorrectedNavState {
  NavState state;                  // at the newest inertial or INS sample
  Pose2 T_map_nav;                 // takes the frame of NAV to the solved map
  std::int64_t graph_version = 0;  // of the solution that the correction comes from; 0: none yet
  std::int64_t jumps = 0;          // how often the correction changed
  double last_jump_m = 0.0;        // what its last change moved the vehicle by
  double last_jump_yaw_rad = 0.0;
};

}  // namespace seastitch
