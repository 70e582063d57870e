#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <variant>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/strapdown.hpp"

// Samples that can be used: checked, and with the time that is true of them.
namespace seastitch {

struct SoundSpeedEvent {
  double speed_mps;
};
struct DvlEvent {
  Eigen::Vector3d v_dvl_mps;
  Eigen::Vector3d sigma_mps;
};
struct DepthEvent {
  double depth_m;
  double sigma_m;
};
struct FixEvent {
  Eigen::Vector2d north_east_m;
  Eigen::Matrix2d covariance_m2;
  std::string source;
};
struct AttitudeEvent {
  Eigen::Quaterniond q_map_imu;
  Eigen::Vector3d sigma_rpy_rad;
  Alignment alignment;
};
struct ImuEvent {
  InertialRates rates;
};

// At one instant sound speed comes before the DVL that it corrects, and aiding before inertial
// data, which carry the state beyond it.
using Measurement =
    std::variant<SoundSpeedEvent, DvlEvent, DepthEvent, FixEvent, AttitudeEvent, ImuEvent>;

struct Event {
  Time time;
  Measurement measurement;
  friend bool operator<(const Event& a, const Event& b) {
    return std::pair(a.time, a.measurement.index()) < std::pair(b.time, b.measurement.index());
  }
};

template <class T>
struct Stamped {
  Time time;
  T value;
};

}  // namespace seastitch
