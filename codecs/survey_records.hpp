#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/sensors.hpp"

// What survey files hold, whatever their format.
namespace seastitch {

// A detection that its maker has already placed, in the level frame of the vehicle at the time of
// the ping: x ahead, y starboard, z down.
struct PlacedBeam {
  Eigen::Vector3f p_level_m = Eigen::Vector3f::Zero();
  float sigma_z_m = 0.0f;  // 1 sigma; 0 = not given
  std::uint8_t flags = 0;  // BeamFlag
};

// A ping as its maker's ray trace left it: soundings without raw times and angles.
struct PlacedPing {
  Time time;
  std::uint32_t ping_number = 0;
  std::uint8_t head = 0;
  // Where the frame's origin lies: x, y by a place in the vehicle, z by a depth below the water
  // line (nothing: z counts from that place).
  Eigen::Vector3d p_vehicle_origin_m = Eigen::Vector3d::Zero();
  std::optional<double> origin_depth_m;
  std::vector<PlacedBeam> soundings;
};

struct GivenPosition {
  double latitude_rad = 0.0;  // WGS 84
  double longitude_rad = 0.0;
  Eigen::Vector2d sigma_north_east_m = Eigen::Vector2d::Zero();  // 1 sigma; 0 = not given
};

struct GivenVelocity {
  Eigen::Vector3d v_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_mps = Eigen::Vector3d::Zero();  // 1 sigma; 0 = not given
};

// Output of a navigation sensor or system at one instant: at the place and in the axes of that
// sensor, with no correction of ours. A field is absent where it is not given or flagged invalid.
struct NavigationRecord {
  Time time;
  std::optional<GivenPosition> position;
  std::optional<Eigen::Vector2d> grid_north_east_m;  // in a map grid that the source does not name
  std::optional<double> depth_m;                     // below the water line
  std::optional<double> height_m;                    // above the ellipsoid
  std::optional<double> water_line_height_m;         // the same, of the water line
  std::optional<double> heave_m;                     // positive down
  std::optional<Attitude> attitude;
  // Of sensors that give no more than that.
  std::optional<Eigen::Vector2d> roll_pitch_rad;
  std::optional<double> heading_rad;  // clockwise from true north
  std::optional<GivenVelocity> velocity;
  std::uint32_t status = 0;  // the source's own
  std::string source;        // the sensor or message: "#SKM0", "A1", "sbet"
};

// Speed of sound that a probe measured at the transducer.
struct SurfaceSoundSpeed {
  Time time;
  double speed_mps = 0.0;
};

// A transmitter or receiver in the vehicle.
struct InstalledArray {
  Eigen::Isometry3d T_vehicle_array = Eigen::Isometry3d::Identity();
  // Acoustic centres in the array's own axes, by MbesBeam::tx_array; of a receiver the first.
  std::vector<Eigen::Vector3d> centres_m{Eigen::Vector3d::Zero()};

  // A centre that is not there is the first one.
  Eigen::Isometry3d At(std::size_t tx_array) const {
    const std::size_t i = tx_array < centres_m.size() ? tx_array : 0;
    return T_vehicle_array * Eigen::Translation3d(centres_m[i]);
  }
};

struct InstalledSensor {
  std::string name;  // as the file has it: "POSI_1", "P1", "MS"
  bool active = false;
  Eigen::Isometry3d T_vehicle_sensor = Eigen::Isometry3d::Identity();
  double delay_s = 0.0;
};

// Installation parameters. Vehicle axes: forward, starboard, down from the reference point.
struct SonarInstallation {
  Time time;
  std::string model;
  // By MbesPing::head; where there are fewer than heads, the last serves the rest.
  std::vector<InstalledArray> transmitters;
  std::vector<InstalledArray> receivers;
  double water_line_m = 0.0;  // down from the reference point
  std::vector<InstalledSensor> sensors;
  std::map<std::string, std::string> values;  // all that the file gives, for showing

  // Nothing where the file names no such array.
  const InstalledArray* TransmitterOf(std::size_t head) const { return Of(transmitters, head); }
  const InstalledArray* ReceiverOf(std::size_t head) const { return Of(receivers, head); }

 private:
  static const InstalledArray* Of(const std::vector<InstalledArray>& arrays, std::size_t head) {
    return arrays.empty() ? nullptr : &arrays[std::min(head, arrays.size() - 1)];
  }
};

// Settings of the sonar while it ran, in its maker's words.
struct SonarSettings {
  Time time;
  std::map<std::string, std::string> values;
};

using SurveyRecord = std::variant<MbesPing,
                                  PlacedPing,
                                  NavigationRecord,
                                  SoundVelocityProfile,
                                  SurfaceSoundSpeed,
                                  SonarInstallation,
                                  SonarSettings>;

}  // namespace seastitch
