#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/time.hpp"

// What the devices said: no filter, no lever arm. SI and radians; sensor axes unless named.
namespace seastitch {

struct Attitude {
  Eigen::Quaterniond q_ned_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rpy_rad = Eigen::Vector3d::Zero();  // roll, pitch, yaw, 1 sigma
};

struct ImuSample {
  Time time;
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();   // x forward, y right, z down
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  // at rest and level: (0, 0, -g)
  std::optional<Attitude> attitude;                               // where the device computes one
};

struct DvlBeam {
  bool valid = false;
  double range_m = 0.0;       // slant range
  double velocity_mps = 0.0;  // along the beam, positive towards the bottom; 0 where not given
};

struct DvlSample {
  Time time;                 // centre of the ping
  bool bottom_lock = false;  // false: velocity and sigma are zero and mean nothing
  Eigen::Vector3d v_dvl_mps = Eigen::Vector3d::Zero();    // over ground, x fwd, y right, z down
  Eigen::Vector3d sigma_v_mps = Eigen::Vector3d::Zero();  // 1 sigma a component
  std::array<DvlBeam, 4> beams;
  std::optional<double> altitude_m;  // vertical, above the bottom
};

struct DepthSample {
  Time time;
  double pressure_pa = 0.0;  // gauge; 0 where not given
  double depth_m = 0.0;      // below the water line, positive down
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
  std::uint8_t flags = 0;  // BeamFlag
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
};

// When the last bottom echo came, by the beams that are valid and plausible.
Time LastEcho(const MbesPing& ping);

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

// Dead-reckoned state of the vehicle.
struct NavState {
  Time time;
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
  // north, east, down [m], then roll, pitch, yaw [rad].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  bool bottom_lock = false;
};

}  // namespace seastitch
