#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/geometry/sound_ray.hpp"

namespace seastitch {

// One detection on the seabed.
struct Sounding {
  Eigen::Vector3d p_map;
  int beam = 0;                // its place in the ping
  float depth_sigma_m = 0.0f;  // 1 sigma by the sonar; 0 = not given
};

struct GeoreferencedPing {
  Time time;                                                        // first transmit pulse
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();  // at `time`
  double speed_mps = 0.0;  // horizontal, from `time` to the last echo
  int beams_read = 0;      // all that the sonar delivered
  int beams_invalid = 0;   // of these, without kBeamValid
  int beams_refused = 0;   // of these, impossible: a number that cannot be, or a ray that turned up
  // The ping's sound speed cannot be; the profile's was taken.
  bool speed_from_profile = false;
  std::vector<Sounding> soundings;  // by rising beam
};

// T_map_vehicle at a time, or nothing.
using PoseLookup = std::function<std::optional<Eigen::Isometry3d>(Time)>;

// Unit vector on the intersection of the transmit cone (tilt off the plane across the transmit
// array's axis) and the receive cone (angle off the plane across the receive array's axis), the one
// of the two solutions towards tx_axis x rx_axis: downward for a sonar that looks down. Nothing
// where the cones do not meet. The axes are unit vectors and need not be at right angles.
std::optional<Eigen::Vector3d> IntersectCones(const Eigen::Vector3d& tx_axis,
                                              double tx_tilt_rad,
                                              const Eigen::Vector3d& rx_axis,
                                              double rx_angle_rad);

// Puts every valid beam of the ping on the seabed. The transmit cone stands as the sonar did when
// this beam's pulse left, the receive cone as it did when the echo came. The ray is traced once,
// one-way for half the travel time, from midway between the two places: the true locus is an
// ellipse with these as foci, which for a baseline b and range r is within b^2 / (8 r) of that
// circle (0.01 mm for 5 cm of travel at 30 m).
//
// Nothing where the lookup has no pose for some instant from `time` to the last echo.
std::optional<GeoreferencedPing> Georeference(const MbesPing& ping,
                                              const PoseLookup& T_map_vehicle_at,
                                              const VehicleGeometry& vehicle,
                                              const RayTracer& rays);

}  // namespace seastitch
