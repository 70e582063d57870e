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

// Records that the readers of all survey file formats give (SurveyRecord).
namespace seastitch {

// A sounding that the sonar's own software has ray traced. Level frame of the vehicle at the time
// of the ping (heading, without roll and pitch): x forward, y starboard, z down [m]. Origin:
// PlacedPing.
struct PlacedBeam {
  Eigen::Vector3f p_level_m = Eigen::Vector3f::Zero();
  float sigma_z_m = 0.0f;  // 1 sigma; 0 = not given
  std::uint8_t flags = 0;  // BeamFlag
};

// A ping as soundings that the sonar's own software has ray traced, without travel times and
// angles.
struct PlacedPing {
  Time time;
  std::uint32_t ping_number = 0;
  std::uint8_t head = 0;
  // Origin of the soundings' x and y: a point of the vehicle, forward, starboard, down of its
  // reference point. Also of their z, where origin_depth_m is absent.
  Eigen::Vector3d p_vehicle_origin_m = Eigen::Vector3d::Zero();
  // Origin of their z: depth below the water line at the time of the ping, where the file states
  // it.
  std::optional<double> origin_depth_m;
  std::vector<PlacedBeam> soundings;
};

// Output of a navigation sensor or system at one instant, without any correction: position and
// velocity are those of the sensor (not of the vehicle's reference point), attitude is that of the
// sensor's axes. A field is absent where the source does not state it or flags it invalid.
struct NavigationRecord {
  Time time;
  // Time of arrival by the clock of the sonar, where `time` is that of the sensor and the file has
  // both.
  std::optional<Time> arrival{};
  std::optional<GeoPosition> position;
  std::optional<Eigen::Vector2d> grid_north_east_m;  // in a map grid that the source does not name
  std::optional<double> depth_m;                     // below the water line
  std::optional<double> height_m;                    // above the ellipsoid
  std::optional<double> water_line_height_m;         // the same, of the water line
  std::optional<double> heave_m;                     // positive down
  std::optional<Attitude> attitude;
  // Instead of `attitude`, from sensors or messages that have only a part of it.
  std::optional<Eigen::Vector2d> roll_pitch_rad;  // roll port up, pitch bow up
  std::optional<double> heading_rad;              // clockwise from true north
  std::optional<GeoVelocity> velocity;
  std::uint32_t status = 0;  // status word of the source, bits as its format defines them
  // Sensor or message that it comes from: "#SKM0" (KMALL), "A1" (.all attitude, sensor 1), "sbet".
  std::string source;
};

// Speed of sound that a probe measured at the transducer.
struct SurfaceSoundSpeed {
  Time time;
  double speed_mps = 0.0;
};

// A transmit or receive array as installed in the vehicle.
struct InstalledArray {
  Eigen::Isometry3d T_vehicle_array = Eigen::Isometry3d::Identity();
  // Acoustic centres in the array's own axes. Of a transmitter indexed by MbesBeam::tx_array; a
  // receiver has one.
  std::vector<Eigen::Vector3d> centres_m{Eigen::Vector3d::Zero()};

  // Pose of an acoustic centre. An index without a centre gives the first.
  Eigen::Isometry3d At(std::size_t tx_array) const {
    const std::size_t i = tx_array < centres_m.size() ? tx_array : 0;
    return T_vehicle_array * Eigen::Translation3d(centres_m[i]);
  }
};

// A positioning or motion sensor as installed in the vehicle.
struct InstalledSensor {
  std::string name;     // as in the file: "POSI_1", "P1", "MS"
  bool active = false;  // the sonar used this one, where there are several
  Eigen::Isometry3d T_vehicle_sensor = Eigen::Isometry3d::Identity();
  double delay_s = 0.0;           // as the file states it: by so much its stamps are late
  bool delay_is_applied = false;  // NavigationRecord::time has it subtracted
};

// Installation parameters of a survey. Vehicle axes: forward, starboard, down from the reference
// point.
struct SonarInstallation {
  Time time;  // of the record; valid until the next
  std::string model;
  std::string serial;  // of the sonar head or transmitter; empty: not stated
  // Indexed by MbesPing::head. Heads beyond the end have the last one.
  std::vector<InstalledArray> transmitters;
  std::vector<InstalledArray> receivers;
  double water_line_m = 0.0;  // z of the water line in vehicle axes
  std::vector<InstalledSensor> sensors;
  std::map<std::string, std::string> values;  // all that the file states, for display

  // Null where the file names no array.
  const InstalledArray* TransmitterOf(std::size_t head) const { return Of(transmitters, head); }
  const InstalledArray* ReceiverOf(std::size_t head) const { return Of(receivers, head); }
  // Null where the file has no sensor of this name.
  const InstalledSensor* SensorOf(const std::string& name) const {
    const auto found = std::find_if(
        sensors.begin(), sensors.end(), [&name](const auto& s) { return s.name == name; });
    return found == sensors.end() ? nullptr : &*found;
  }

 private:
  static const InstalledArray* Of(const std::vector<InstalledArray>& arrays, std::size_t head) {
    return arrays.empty() ? nullptr : &arrays[std::min(head, arrays.size() - 1)];
  }
};

// Comparison of the sonar's own clock with the one that it is set by (ZDA).
struct ClockComparison {
  Time time;           // by the sonar's clock
  Time external_time;  // by the other, at the same instant
  std::string source;  // "#SCL0", "C"
};

// Settings of the sonar, with names and values as in the file.
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
                                  ClockComparison,
                                  SonarSettings>;

}  // namespace seastitch
