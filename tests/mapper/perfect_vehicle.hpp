#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <variant>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Latitude and longitude of a place of the map, whose datum is on the equator.
inline GeoPoint PointAt(double north_m, double east_m = 0.0) {
  return {north_m / 6335439.3, east_m / 6378137.0};
}

// A vehicle with perfect sensors (but what is asked of its compass) over a seabed of bumps.
class PerfectVehicle {
 public:
  static constexpr double kSoundMps = 1500.0;
  static constexpr double kDepthM = 10.0;
  static constexpr double kImuStepS = 0.02;

  using Sample = std::variant<ImuSample, DvlSample, DepthSample, MbesPing>;

  static double Seabed(double x, double y) {
    return 20.0 + 0.8 * std::sin(0.35 * x) * std::cos(0.3 * y) +
           0.5 * std::sin(0.11 * x + 0.17 * y) + 0.6 * std::sin(0.21 * x - 0.13 * y + 1.0);
  }

  // What its sensors measure kImuStepS later, in order.
  std::vector<Sample> Step(double speed_mps, double yaw_rate_radps) {
    time += FromSeconds(kImuStepS);
    x_ += speed_mps * kImuStepS * std::cos(yaw_ + 0.5 * yaw_rate_radps * kImuStepS);
    y_ += speed_mps * kImuStepS * std::sin(yaw_ + 0.5 * yaw_rate_radps * kImuStepS);
    yaw_ += yaw_rate_radps * kImuStepS;
    truth_[time] = MakePose({x_, y_, kDepthM}, RotationFromRpy(0.0, 0.0, yaw_));
    compass_error_rad_ += compass_rate_radps * kImuStepS;
    std::vector<Sample> samples{Imu(speed_mps, yaw_rate_radps)};
    if (steps_ % 10 == 0) {
      samples.emplace_back(Dvl(speed_mps));
      samples.emplace_back(DepthSample{time, 0.0, kDepthM, 0.01});
    }
    if (steps_ % 12 == 0 && sonar_on) samples.emplace_back(Ping());
    ++steps_;
    return samples;
  }
  // Stays where it is with every sensor off.
  void Sleep(double seconds) { time += FromSeconds(seconds); }

  // Its true pose at the time of a step.
  Eigen::Isometry3d TrueAt(Time t) const { return truth_.at(t); }
  // Its true pose at the first step at or after t, else at the last.
  Eigen::Isometry3d NearestTrueTo(Time t) const {
    const auto next = truth_.lower_bound(t);
    return next == truth_.end() ? truth_.rbegin()->second : next->second;
  }

  // A position fix of its reference point at its time, off by so much, with a sigma of 1 m.
  PositionFix Fix(const std::string& source = "gps",
                  const Eigen::Vector2d& off_m = Eigen::Vector2d::Zero()) const {
    const Eigen::Vector2d at_m = TrueAt(time).translation().head<2>() + off_m;
    return {PointAt(at_m.x(), at_m.y()), time, Eigen::Matrix2d::Identity(), source};
  }

  Time time = FromUtime(1'700'000'000'000'000);
  bool sonar_on = true;
  double compass_rate_radps = 0.0;  // by which the compass's error grows
  // Faults.
  bool attitude_on = true;
  int attitude_late_steps = 0;  // stamped so many inertial samples late
  double compass_step_rad = 0.0;
  bool bottom_lock = true;
  double dvl_error_mps = 0.0;  // forward
  std::optional<double> dvl_error_velocity_mps;
  double accelerometer_error_mps2 = 0.0;  // forward
  // Stuck at their last values.
  bool gyros_stuck = false;
  bool attitude_frozen = false;

 private:
  ImuSample Imu(double speed_mps, double yaw_rate_radps) {
    ImuSample imu = SoundImu(speed_mps, yaw_rate_radps);
    if (gyros_stuck) imu.angular_rate_radps = last_imu_.angular_rate_radps;
    imu.specific_force_mps2.x() += accelerometer_error_mps2;
    if (attitude_frozen) imu.attitude = last_imu_.attitude;
    last_imu_ = imu;
    return imu;
  }
  ImuSample SoundImu(double speed_mps, double yaw_rate_radps) const {
    ImuSample imu;
    imu.time = time;
    imu.angular_rate_radps = {0.0, 0.0, yaw_rate_radps};
    imu.specific_force_mps2 = {0.0, speed_mps * yaw_rate_radps, -9.805};
    const Time measured = time - attitude_late_steps * FromSeconds(kImuStepS);
    const auto then = truth_.find(measured);
    if (!attitude_on || then == truth_.end()) return imu;
    const double yaw = LevelPose(then->second).yaw + compass_error_rad_ + compass_step_rad;
    imu.attitude = Attitude{Eigen::Quaterniond(RotationFromRpy(0.0, 0.0, yaw)),
                            Eigen::Vector3d(1e-3, 1e-3, 3e-3)};
    return imu;
  }
  DvlSample Dvl(double speed_mps) const {
    DvlSample dvl;
    dvl.time = time;
    dvl.bottom_lock = bottom_lock;
    if (!bottom_lock) return dvl;
    dvl.v_dvl_mps = {speed_mps + dvl_error_mps, 0.0, 0.0};
    dvl.sigma_v_mps = {0.01, 0.01, 0.01};
    dvl.error_velocity_mps = dvl_error_velocity_mps;
    return dvl;
  }
  MbesPing Ping() const {
    MbesPing ping;
    ping.time = time;
    ping.sound_speed_mps = kSoundMps;
    for (int b = 0; b < 96; ++b) {
      const double angle = Deg2Rad(-60.0 + 120.0 * b / 95.0);
      double range_m = 10.0 / std::cos(angle);
      for (int i = 0; i < 50; ++i) {  // half a step each: it settles on any slope below 1
        const double across = range_m * std::sin(angle);
        const double z = Seabed(x_ - across * std::sin(yaw_), y_ + across * std::cos(yaw_));
        range_m = 0.5 * (range_m + (z - kDepthM) / std::cos(angle));
      }
      MbesBeam beam;
      beam.twtt_s = static_cast<float>(2.0 * range_m / kSoundMps);
      beam.rx_angle_rad = static_cast<float>(angle);
      beam.flags = kBeamValid;
      ping.beams.push_back(beam);
    }
    return ping;
  }

  double x_ = 0.0;
  double y_ = 0.0;
  double yaw_ = 0.0;
  double compass_error_rad_ = 0.0;
  std::map<Time, Eigen::Isometry3d> truth_;
  int steps_ = 0;
  ImuSample last_imu_;
};

// A finished submap of its seabed, x_m north of the datum.
inline Submap ImportedSubmap(int id, double x_m) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.trigger = SubmapTrigger::kImported;
  submap.start = submap.frame_time = submap.end = FromUtime(1'000'000 * (id + 10));
  submap.T_map_submap = MakePose({x_m, 0.0, 10.0}, Eigen::Matrix3d::Identity());
  submap.covariance_from_previous = Eigen::Matrix3d(Eigen::Vector3d(0.25, 0.25, 1e-5).asDiagonal());
  for (double x = -10.0; x < 10.0; x += 0.3) {
    for (double y = -8.0; y < 8.0; y += 0.3) {
      submap.cloud.Add(
          Eigen::Vector3d(x, y, PerfectVehicle::Seabed(x_m + x, y) - 10.0).cast<float>());
    }
  }
  return submap;
}

}  // namespace seastitch
