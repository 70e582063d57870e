#include "tests/perf/surveying_vehicle.hpp"

#include <cmath>

#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

constexpr double kSoundMps = 1500.0;
constexpr double kDepthM = 10.0;
constexpr double kAltitudeM = 20.0;
constexpr double kSpeedMps = 2.0;
constexpr double kLineM = 1000.0;
constexpr double kTurnRadiusM = 20.0;
constexpr double kStepS = 0.02;
constexpr int kDvlEvery = 10;
constexpr int kPingEvery = 5;
constexpr double kHalfSwathRad = Deg2Rad(60.0);

double Seabed(double x, double y) {
  return kDepthM + kAltitudeM + 0.6 * std::sin(0.17 * x) * std::cos(0.15 * y) +
         0.4 * std::sin(0.06 * x + 0.08 * y);
}

}  // namespace

// Lines to and fro, half circles between them.
double SurveyingVehicle::YawRate() const {
  const double lap_m = kLineM + kPi * kTurnRadiusM;
  const double along_m = std::fmod(distance_m_, lap_m);
  const bool right = std::fmod(distance_m_, 2.0 * lap_m) < lap_m;
  if (along_m < kLineM) return 0.0;
  return (right ? 1.0 : -1.0) * kSpeedMps / kTurnRadiusM;
}

void SurveyingVehicle::Step(Bus* bus) {
  const double yaw_rate = YawRate();
  time_ += FromSeconds(kStepS);
  distance_m_ += kSpeedMps * kStepS;
  x_ += kSpeedMps * kStepS * std::cos(yaw_ + 0.5 * yaw_rate * kStepS);
  y_ += kSpeedMps * kStepS * std::sin(yaw_ + 0.5 * yaw_rate * kStepS);
  yaw_ += yaw_rate * kStepS;
  SendImu(yaw_rate, bus);
  if (steps_ % kDvlEvery == 0) SendDvlAndDepth(bus);
  if (steps_ % kPingEvery == 0) SendPing(bus);
  ++steps_;
}

void SurveyingVehicle::SendImu(double yaw_rate, Bus* bus) {
  ImuSample imu;
  imu.time = time_;
  imu.angular_rate_radps = {0.0, 0.0, yaw_rate};
  imu.specific_force_mps2 = {0.0, kSpeedMps * yaw_rate, -9.805};
  imu.attitude = Attitude{Eigen::Quaterniond(Eigen::AngleAxisd(yaw_, Eigen::Vector3d::UnitZ())),
                          Eigen::Vector3d(1e-3, 1e-3, 3e-3)};
  bus->Publish("IMU", ToLcm(imu, {time_, imu_seq_++}));
}

void SurveyingVehicle::SendDvlAndDepth(Bus* bus) {
  DvlSample dvl;
  dvl.time = time_;
  dvl.bottom_lock = true;
  dvl.v_dvl_mps = {kSpeedMps, 0.0, 0.0};
  dvl.sigma_v_mps = {0.01, 0.01, 0.01};
  bus->Publish("DVL", ToLcm(dvl, {time_, dvl_seq_++}));
  bus->Publish("DEPTH", ToLcm(DepthSample{time_, 0.0, kDepthM, 0.01}, {time_, depth_seq_++}));
}

void SurveyingVehicle::SendPing(Bus* bus) {
  std::normal_distribution<double> noise_m(0.0, 0.03);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  MbesPing ping;
  ping.time = time_;
  ping.sound_speed_mps = kSoundMps;
  ping.beams.resize(beams_);
  for (int b = 0; b < beams_; ++b) {
    const double angle = kHalfSwathRad * (2.0 * b / (beams_ - 1.0) - 1.0);
    double down_m = kAltitudeM;
    for (int round = 0; round < 5; ++round) {
      const double across_m = down_m * std::tan(angle);
      down_m = Seabed(x_ - across_m * std::sin(yaw_), y_ + across_m * std::cos(yaw_)) - kDepthM;
    }
    if (chance(random_) < 0.01) down_m *= 0.6 + 0.7 * chance(random_);
    MbesBeam& beam = ping.beams[static_cast<std::size_t>(b)];
    beam.rx_angle_rad = static_cast<float>(angle);
    beam.twtt_s =
        static_cast<float>(2.0 * (down_m / std::cos(angle) + noise_m(random_)) / kSoundMps);
    beam.flags = kBeamValid;
  }
  soundings_ += beams_;
  bus->Publish("MBES_PING", ToLcm(ping, {time_, ping_seq_++}));
}

}  // namespace seastitch
