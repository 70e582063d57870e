#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"

namespace seastitch {

// T_map_vehicle at a time, or nothing.
using PoseLookup = std::function<std::optional<Eigen::Isometry3d>(Time)>;

// Whether a valid beam has angles and a time that a sonar can have measured.
inline bool IsUsable(const MbesBeam& beam) {
  return IsPlausible(beam) && beam.twtt_s > 0.0f && std::abs(beam.rx_angle_rad) < kPi / 2.0 &&
         std::abs(beam.tx_tilt_rad) < kPi / 2.0;
}

// Position of an array in the map, and its axis: forward for the transmitter, starboard for the
// receiver.
struct ArrayState {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
};

// Position and axis of both arrays of a sonar from the first pulse of a ping to its last echo.
class SonarMotion {
 public:
  // Nothing where the lookup has no pose for some instant from the ping's time to the last echo of
  // a usable beam.
  static std::optional<SonarMotion> Of(const MbesPing& ping,
                                       const PoseLookup& T_map_vehicle_at,
                                       const VehicleGeometry& vehicle);

  ArrayState TxAt(double after_start_s) const { return At(after_start_s, &Knot::tx); }
  ArrayState RxAt(double after_start_s) const { return At(after_start_s, &Knot::rx); }
  // The transmit array with the position of one of its parts; without such a part, of the first.
  ArrayState TxPartAt(double after_start_s, std::size_t part) const;
  // Parts of the transmit array; 0: it is whole.
  std::size_t parts() const { return parts_.size(); }

  const Eigen::Isometry3d& T_map_vehicle_first() const { return first_; }

 private:
  struct Knot {
    ArrayState tx;
    ArrayState rx;
  };
  static ArrayState Between(const ArrayState& a, const ArrayState& b, double w) {
    const Eigen::Vector3d axis = a.axis + w * (b.axis - a.axis);
    // Normalised with 1 / sqrt(n) = (3 - n) / 2, valid near 1: axes at neighbouring knots differ by
    // a few degrees at most.
    return {a.p_map + w * (b.p_map - a.p_map), 0.5 * (3.0 - axis.squaredNorm()) * axis};
  }
  double KnotsSince(double after_start_s) const {
    return std::clamp(after_start_s / step_s_, 0.0, double(knots_.size() - 1));
  }
  // The knot before.
  std::size_t KnotAt(double knots) const {
    return std::min(static_cast<std::size_t>(knots), knots_.size() - 2);
  }
  ArrayState At(double after_start_s, ArrayState Knot::*array) const {
    const double at = KnotsSince(after_start_s);
    const std::size_t i = KnotAt(at);
    return Between(knots_[i].*array, knots_[i + 1].*array, at - static_cast<double>(i));
  }

  double step_s_ = 0.0;
  std::vector<Knot> knots_;
  // Of each part of the transmit array, at each knot: from the array's position to the part's.
  std::vector<std::vector<Eigen::Vector3d>> parts_;
  Eigen::Isometry3d first_ = Eigen::Isometry3d::Identity();
};

}  // namespace seastitch
