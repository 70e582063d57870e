#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

#include "bench/sensor_errors.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {

// Errors of a vehicle's sensors, of the bench's class mems: a compass of 1 deg, a Doppler log as
// delivered. The same samples get the same errors.
class NoisySensors {
 public:
  explicit NoisySensors(std::uint32_t seed) : random_(seed) {
    heading_bias_rad_ = Deg2Rad(Draw(errors_.heading_bias_deg));
    heading_wander_rad_ = Deg2Rad(Draw(errors_.heading_wander_deg));
    dvl_scale_ = 1.0 + Draw(errors_.dvl_scale);
    dvl_yaw_rad_ = Deg2Rad(Draw(errors_.dvl_misalignment_deg));
    gyro_bias_radps_ = {Draw(errors_.gyro_bias_radps),
                        Draw(errors_.gyro_bias_radps),
                        Draw(errors_.gyro_bias_radps)};
    accelerometer_bias_mps2_ = {Draw(errors_.accel_bias_mps2),
                                Draw(errors_.accel_bias_mps2),
                                Draw(errors_.accel_bias_mps2)};
  }

  void AddTo(ImuSample* imu) {
    constexpr double kStepS = 0.02;
    const double wander_s = errors_.heading_wander_tau_s;
    heading_wander_rad_ +=
        -heading_wander_rad_ * kStepS / wander_s +
        Deg2Rad(Draw(errors_.heading_wander_deg * std::sqrt(2 * kStepS / wander_s)));
    imu->angular_rate_radps +=
        gyro_bias_radps_ + Draw3(errors_.gyro_noise_radps_rthz / std::sqrt(kStepS));
    imu->specific_force_mps2 +=
        accelerometer_bias_mps2_ + Draw3(errors_.accel_noise_mps2_rthz / std::sqrt(kStepS));
    const Eigen::Vector3d white_rad = Draw3(Deg2Rad(errors_.attitude_white_deg));
    if (!imu->attitude) return;
    Attitude& attitude = *imu->attitude;
    const Eigen::Quaterniond error(RotationFromRpy(
        white_rad.x(), white_rad.y(), heading_bias_rad_ + heading_wander_rad_ + white_rad.z()));
    attitude.q_ned_imu = error * attitude.q_ned_imu;
    attitude.sigma_rpy_rad = {Deg2Rad(0.1), Deg2Rad(0.1), Deg2Rad(1.0)};
  }
  void AddTo(DvlSample* dvl) {
    const Eigen::Vector3d white_mps = Draw3(errors_.dvl_noise_mps);
    if (!dvl->bottom_lock) return;
    dvl->v_dvl_mps =
        RotationFromRpy(0.0, 0.0, dvl_yaw_rad_) * dvl->v_dvl_mps * dvl_scale_ + white_mps;
  }
  void AddTo(DepthSample* depth) { depth->depth_m += Draw(errors_.depth_noise_m); }
  void AddTo(MbesPing* ping) {
    for (MbesBeam& beam : ping->beams) beam.twtt_s *= static_cast<float>(1.0 + Draw(1e-3));
  }
  void AddTo(PositionFix* fix) {
    fix->latitude_rad += Draw(1.0) / 6.37e6;
    fix->longitude_rad += Draw(1.0) / 6.37e6;
  }

 private:
  const bench::SensorErrors errors_ = bench::SensorErrors::OfClass("mems");

  double Draw(double sigma) { return std::normal_distribution<double>(0.0, sigma)(random_); }
  Eigen::Vector3d Draw3(double sigma) {
    const double x = Draw(sigma), y = Draw(sigma);
    return {x, y, Draw(sigma)};
  }

  std::mt19937 random_;
  double heading_bias_rad_ = 0.0;
  double heading_wander_rad_ = 0.0;
  double dvl_scale_ = 1.0;
  double dvl_yaw_rad_ = 0.0;
  Eigen::Vector3d gyro_bias_radps_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_mps2_ = Eigen::Vector3d::Zero();
};

}  // namespace seastitch
