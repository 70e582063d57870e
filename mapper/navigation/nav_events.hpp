#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <variant>

#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "mapper/navigation/filter/strapdown.hpp"
#include "mapper/navigation/navigation.hpp"

// Checked samples with corrected times.
namespace seastitch {

struct SoundSpeedEvent {
  double speed_mps;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.speed_mps);
  }
};
struct DvlEvent {
  Eigen::Vector3d v_dvl_mps;
  Eigen::Vector3d sigma_mps;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.v_dvl_mps, self.sigma_mps);
  }
};
struct DepthEvent {
  double depth_m;
  double sigma_m;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.depth_m, self.sigma_m);
  }
};
struct FixEvent {
  Eigen::Vector2d north_east_m;
  Eigen::Matrix2d covariance_m2;
  std::string source;
  Eigen::Vector3d p_vehicle_m;  // point that was measured: antenna or transponder

  // The same fix for the vehicle's reference point, with the given attitude.
  FixEvent OfVehicle(const Eigen::Matrix3d& R_map_vehicle) const {
    FixEvent fix = *this;
    fix.north_east_m -= (R_map_vehicle * p_vehicle_m).head<2>();
    fix.p_vehicle_m.setZero();
    return fix;
  }

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.north_east_m, self.covariance_m2, self.source, self.p_vehicle_m);
  }
};
struct AttitudeEvent {
  Eigen::Quaterniond q_map_imu;
  Eigen::Vector3d sigma_rpy_rad;
  HeadingAlignment alignment;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.q_map_imu, self.sigma_rpy_rad, self.alignment);
  }
};
// A sample that was refused before it got here: for the share of refused samples.
struct UnusableEvent {
  NavSensor sensor;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.sensor);
  }
};
struct ImuEvent {
  InertialRates rates;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.rates);
  }
};

// Order at the same instant: sound speed before the DVL that it corrects, and aiding before
// inertial data, which carry the state further.
using Measurement = std::variant<SoundSpeedEvent,
                                 DvlEvent,
                                 DepthEvent,
                                 FixEvent,
                                 AttitudeEvent,
                                 UnusableEvent,
                                 ImuEvent>;

struct Event {
  Time time;
  Measurement measurement;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.time, self.measurement);
  }
  friend bool operator<(const Event& a, const Event& b) {
    return std::pair(a.time, a.measurement.index()) < std::pair(b.time, b.measurement.index());
  }
};

template <class T>
struct Stamped {
  Time time;
  T value;

  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.time, self.value);
  }
};

}  // namespace seastitch
