#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/geometry/sonar_motion.hpp"
#include "mapper/geometry/sound_ray.hpp"

namespace seastitch {

// One detection on the seabed.
struct Sounding {
  Eigen::Vector3d p_map;
  int beam = 0;                // its place in the ping
  float depth_sigma_m = 0.0f;  // 1 sigma by the sonar; 0 = not given
};

// What a sonar measured in one ping.
struct PingSoundings {
  int beams_invalid = 0;  // of those read, without kBeamValid
  int beams_refused = 0;  // of those read, refused: implausible values, or a ray bent upwards
  // Of a part of the transmit array that the vehicle does not have; the first one is used.
  int beams_of_unknown_part = 0;
  // The ping's sound speed is implausible; the profile's is used.
  bool speed_from_profile = false;
  std::vector<Sounding> soundings;  // by rising beam
};

struct GeoreferencedPing : PingSoundings {
  Time time;                                                        // first transmit pulse
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();  // at `time`
  std::uint32_t ping_number = 0;                                    // the device's counter
  std::uint8_t head = 0;                                            // of a sonar with several
  bool bottom_lock = true;                                          // of navigation, at `time`
  // Navigation's estimate of the DVL's angle about the vertical, now.
  double dvl_yaw_rad = 0.0;
  int beams_read = 0;  // all that the sonar delivered
};

// Geometry of one detection by the transmit and the receive array, each at its own position.
struct Detection {
  Eigen::Vector3d tx_axis;          // unit vector forward along the transmit array
  Eigen::Vector3d rx_axis;          // unit vector to starboard along the receive array
  double sin_tilt;                  // component along tx_axis of the direction from the transmitter
  double sin_angle;                 // component along rx_axis of the direction from the receiver
  Eigen::Vector3d half_baseline_m;  // half the way from transmitter to receiver
  double half_path_m;               // half the way of the sound, there and back
};

// Several of them, whose components lie beside each other.
struct Detections {
  static constexpr std::size_t kMost = RayFan::kBeside;
  using Numbers = RayFan::Numbers;
  using Vectors = std::array<Numbers, 3>;  // x, y, z
  Vectors tx_axis{}, rx_axis{};
  Numbers sin_tilt = Numbers::Zero(), sin_angle = Numbers::Zero();
  Vectors half_baseline_m{};
  Numbers half_path_m = Numbers::Zero();

  void Set(std::size_t i, const Detection& detection) {
    const auto k = static_cast<Eigen::Index>(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto c = static_cast<Eigen::Index>(axis);
      tx_axis[axis][k] = detection.tx_axis[c];
      rx_axis[axis][k] = detection.rx_axis[c];
      half_baseline_m[axis][k] = detection.half_baseline_m[c];
    }
    sin_tilt[k] = detection.sin_tilt;
    sin_angle[k] = detection.sin_angle;
    half_path_m[k] = detection.half_path_m;
  }
};

// The point that reflected, seen from midway between transmitter and receiver, in water of one
// speed: on the transmit cone, on the receive cone and on the ellipsoid of equal travel time; of
// the two such points the lower one (z is down). The axes need not be at right angles, and an array
// may be mounted backwards. Nothing where cones and ellipsoid do not meet.
std::optional<Eigen::Vector3d> EchoFromMidway(const Detection& detection);
std::array<std::optional<Eigen::Vector3d>, Detections::kMost> EchoesFromMidway(
    const Detections& detections);

// What bends a swath beyond the sound speeds that are known, as a part of one: the smile, of which
// the depth at nadir stays, and the part of it that is caused by the water and stretches the swath.
struct SwathCorrection {
  double smile = 0.0;
  double by_water = 0.0;
};

// Georeferences every valid beam of the ping. The transmit cone uses position and axis of the
// transmit array (of its part that sent this beam) when this beam's pulse left; the receive cone
// those of the receive array when the echo arrived. The sounding lies on both cones and on the
// ellipsoid whose foci are the two positions. The ray is traced once, one-way, from midway between
// them. The error by using one path for both is below 0.2 mm (arrays 25 cm apart, a seabed 5 m
// away; kongsberg_test.cpp). sonar: its motion during this ping.
PingSoundings PlaceSoundings(const MbesPing& ping,
                             const SonarMotion& sonar,
                             const RayTracer& rays,
                             const SwathCorrection& correction = {});
// The ping without its soundings.
GeoreferencedPing WithoutSoundings(const MbesPing& ping, const SonarMotion& sonar);
// Both. Nothing where the lookup has no pose for some instant from `time` to the last echo.
std::optional<GeoreferencedPing> Georeference(const MbesPing& ping,
                                              const PoseLookup& T_map_vehicle_at,
                                              const VehicleGeometry& vehicle,
                                              const RayTracer& rays,
                                              const SwathCorrection& correction = {});

// Soundings that their source has placed already, where the vehicle was at the ping's time.
GeoreferencedPing Georeference(const SoundingPing& ping, const Eigen::Isometry3d& T_map_vehicle);

}  // namespace seastitch
