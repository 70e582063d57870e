#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {

// Errors of a vehicle's sensors, of the bench's class mems: a compass of 1 deg, a Doppler log as
// delivered. The same samples get the same errors.
class NoisySensors {
 public:
  explicit NoisySensors(std::uint32_t seed) : random_(seed) {
    heading_bias_rad_ = Deg2Rad(Draw(0.6));
    heading_wander_rad_ = Deg2Rad(Draw(0.6));
    dvl_scale_ = 1.0 + Draw(0.005);
    dvl_yaw_rad_ = Deg2Rad(Draw(0.3));
    gyro_bias_radps_ = {Draw(4.8e-5), Draw(4.8e-5), Draw(4.8e-5)};
    accelerometer_bias_mps2_ = {Draw(2e-2), Draw(2e-2), Draw(2e-2)};
  }

  void AddTo(ImuSample* imu) {
    constexpr double kStepS = 0.02, kWanderS = 300.0;
    heading_wander_rad_ += -heading_wander_rad_ * kStepS / kWanderS +
                           Deg2Rad(Draw(0.6 * std::sqrt(2 * kStepS / kWanderS)));
    imu->angular_rate_radps += gyro_bias_radps_ + Draw3(8.7e-5 / std::sqrt(kStepS));
    imu->specific_force_mps2 += accelerometer_bias_mps2_ + Draw3(1e-3 / std::sqrt(kStepS));
    const Eigen::Vector3d white_rad = Draw3(Deg2Rad(0.02));
    if (!imu->attitude) return;
    Attitude& attitude = *imu->attitude;
    const Eigen::Quaterniond error(RotationFromRpy(
        white_rad.x(), white_rad.y(), heading_bias_rad_ + heading_wander_rad_ + white_rad.z()));
    attitude.q_ned_imu = error * attitude.q_ned_imu;
    attitude.sigma_rpy_rad = {Deg2Rad(0.1), Deg2Rad(0.1), Deg2Rad(1.0)};
  }
  void AddTo(DvlSample* dvl) {
    const Eigen::Vector3d white_mps = Draw3(0.01);
    if (!dvl->bottom_lock) return;
    dvl->v_dvl_mps =
        RotationFromRpy(0.0, 0.0, dvl_yaw_rad_) * dvl->v_dvl_mps * dvl_scale_ + white_mps;
  }
  void AddTo(DepthSample* depth) { depth->depth_m += Draw(0.01); }
  void AddTo(MbesPing* ping) {
    for (MbesBeam& beam : ping->beams) beam.twtt_s *= static_cast<float>(1.0 + Draw(1e-3));
  }
  void AddTo(PositionFix* fix) {
    fix->latitude_rad += Draw(1.0) / 6.37e6;
    fix->longitude_rad += Draw(1.0) / 6.37e6;
  }

 private:
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
