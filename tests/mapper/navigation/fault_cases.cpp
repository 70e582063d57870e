#include "tests/mapper/navigation/fault_cases.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch::test {
namespace {

constexpr double kForeverS = std::numeric_limits<double>::infinity();

std::string Text(const char* format, double value) {
  char text[80];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// Calls act(sample) for the samples within [from_s, to_s) of the dive.
template <class Samples, class Act>
void Within(Time start, Samples* samples, double from_s, double to_s, const Act& act) {
  for (auto& sample : *samples) {
    const double t = ToSeconds(sample.time - start);
    if (t >= from_s && t < to_s) act(&sample);
  }
}

void DropAttitude(Dive* dive, double from_s, double to_s) {
  Within(
      dive->imu[0].time, &dive->imu, from_s, to_s, [](ImuSample* imu) { imu->attitude.reset(); });
}

void DropDvl(Dive* dive, double from_s, double to_s) {
  Within(dive->imu[0].time, &dive->dvl, from_s, to_s, [](DvlSample* dvl) {
    dvl->bottom_lock = false;
    dvl->v_dvl_mps.setZero();
    dvl->sigma_v_mps.setZero();
  });
}

}  // namespace

FaultCase LateAttitude(double delay_s) {
  return {Text("attitude late by %.0f ms", 1e3 * delay_s), [delay_s](Dive* dive) {
            const auto samples = static_cast<std::size_t>(std::lround(delay_s * dive->imu_hz));
            for (std::size_t i = dive->imu.size(); i-- > 0;)
              dive->imu[i].attitude = dive->imu[i - std::min(i, samples)].attitude;
          }};
}

FaultCase LateDvl(double delay_s) {
  return {Text("DVL late by %.1f s", delay_s), [delay_s](Dive* dive) {
            for (DvlSample& dvl : dive->dvl) dvl.time += FromSeconds(delay_s);
          }};
}

FaultCase AttitudeEvery(double interval_s) {
  return {Text("attitude at %.0f Hz", 1.0 / interval_s), [interval_s](Dive* dive) {
            const auto every = static_cast<std::size_t>(std::lround(interval_s * dive->imu_hz));
            for (std::size_t i = 0; i < dive->imu.size(); ++i)
              if (i % every != 0) dive->imu[i].attitude.reset();
          }};
}

FaultCase HeadingStep(double degrees, double from_s, double to_s) {
  const bool stays = to_s == kForeverS;
  FaultCase fault;
  fault.name =
      Text(stays ? "heading step of %.0f deg, stays" : "heading step of %.0f deg, 120 s", degrees);
  fault.apply = [=](Dive* dive) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(Deg2Rad(degrees), Eigen::Vector3d::UnitZ()));
    Within(dive->imu[0].time, &dive->imu, from_s, to_s, [&](ImuSample* imu) {
      imu->attitude->q_ned_imu = turn * imu->attitude->q_ned_imu;
    });
  };
  fault.from_s = from_s;
  fault.to_s = to_s;
  fault.unseen = stays;
  fault.tell = [=](Dive* dive) { DropAttitude(dive, from_s, to_s); };
  return fault;
}

FaultCase WrongVelocities(double from_s, double duration_s) {
  FaultCase fault;
  fault.name = Text("wrong velocities for %.0f s", duration_s);
  fault.from_s = from_s;
  fault.to_s = from_s + duration_s;
  fault.apply = [=](Dive* dive) {
    const Eigen::Matrix3d R = dive->vehicle.T_vehicle_dvl.linear();
    Within(dive->imu[0].time, &dive->dvl, from_s, from_s + duration_s, [&](DvlSample* dvl) {
      const Eigen::Vector3d v = R * dvl->v_dvl_mps;
      dvl->v_dvl_mps = R.transpose() * Eigen::Vector3d(0.5 * v.x(), v.y() + 0.6, v.z());
    });
  };
  fault.unseen = duration_s > 30.0;
  fault.tell = [=](Dive* dive) { DropDvl(dive, from_s, from_s + duration_s); };
  return fault;
}

FaultCase Stuck(StuckSensor sensor, double from_s, double duration_s) {
  const char* format = sensor == StuckSensor::kGyro            ? "gyro stuck for %.0f s"
                       : sensor == StuckSensor::kAccelerometer ? "accelerometer stuck for %.0f s"
                                                               : "attitude frozen for %.0f s";
  FaultCase fault;
  fault.name = Text(format, duration_s);
  fault.from_s = from_s;
  fault.to_s = from_s + duration_s;
  fault.apply = [=](Dive* dive) {
    std::optional<ImuSample> held;
    Within(dive->imu[0].time, &dive->imu, from_s, from_s + duration_s, [&](ImuSample* imu) {
      if (!held) held = *imu;
      if (sensor == StuckSensor::kGyro) imu->angular_rate_radps = held->angular_rate_radps;
      if (sensor == StuckSensor::kAccelerometer)
        imu->specific_force_mps2 = held->specific_force_mps2;
      if (sensor == StuckSensor::kAttitude) imu->attitude = held->attitude;
    });
  };
  return fault;
}

FaultCase InertialGap(double from_s, double duration_s) {
  FaultCase fault;
  fault.name = Text("no inertial data for %.1f s", duration_s);
  fault.from_s = from_s;
  fault.to_s = from_s + duration_s;
  fault.apply = [=](Dive* dive) {
    const Time start = dive->imu[0].time;
    std::erase_if(dive->imu, [=](const ImuSample& imu) {
      const double t = ToSeconds(imu.time - start);
      return t >= from_s && t < from_s + duration_s;
    });
  };
  return fault;
}

std::vector<FaultCase> FaultCases() {
  constexpr double kFromS = 195.0;
  std::vector<FaultCase> cases;
  for (const double s : {0.0, 0.05, 0.1, 0.2, 0.45}) cases.push_back(LateAttitude(s));
  for (const double s : {0.1, 0.5, 1.0}) cases.push_back(LateDvl(s));
  for (const double s : {1.0, 0.1}) cases.push_back(AttitudeEvery(s));
  for (const double degrees : {5.0, 20.0})
    for (const double to_s : {kFromS + 120.0, kForeverS})
      cases.push_back(HeadingStep(degrees, kFromS, to_s));
  for (const double s : {5.0, 30.0, 120.0}) cases.push_back(WrongVelocities(kFromS, s));
  for (const StuckSensor sensor :
       {StuckSensor::kGyro, StuckSensor::kAccelerometer, StuckSensor::kAttitude})
    for (const double s : {10.0, 30.0, 120.0}) cases.push_back(Stuck(sensor, kFromS, s));
  for (const double s : {0.5, 2.0, 10.0}) cases.push_back(InertialGap(kFromS, s));
  return cases;
}

}  // namespace seastitch::test
