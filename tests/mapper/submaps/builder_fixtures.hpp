#pragma once

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/submap_builder.hpp"
#include "tests/mapper/submaps/synthetic_swath.hpp"

// A drive over a seabed, for the tests of the submap builder.
namespace seastitch {

inline constexpr double kStepM = 0.25;
inline constexpr double kSpeedMps = 1.5;

// Constant drift between any two pings.
inline SubmapBuilder::Drift Loses(double x_m, double y_m, double yaw_rad) {
  return [=](Time, Time) -> Eigen::Matrix3d {
    return Eigen::Vector3d(x_m * x_m, y_m * y_m, yaw_rad * yaw_rad).asDiagonal();
  };
}

// Hindsight without corrections.
inline Pose2 NothingLearned(Time, Time) { return {}; }

// Drives a vehicle and collects the submaps that the builder closes.
struct Drive {
  explicit Drive(const SubmapParams& params = {},
                 const CloudFilterParams& filter = {},
                 SubmapBuilder::Drift drift = Loses(0.1, 0.1, Deg2Rad(0.2)))
      : builder(params, filter, std::move(drift), NothingLearned) {}

  void Straight(double length_m) {
    for (double gone = 0.0; gone < length_m; gone += kStepM) Step(0.0);
  }
  void Turn(double angle_rad, double radius_m) {
    const double steps = std::ceil(std::abs(angle_rad) * radius_m / kStepM);
    for (int i = 0; i < static_cast<int>(steps); ++i) Step(angle_rad / steps);
  }
  void Wait(double seconds) { time += FromSeconds(seconds); }
  void Step(double turn_rad) {
    yaw += turn_rad;
    x += kStepM * std::cos(yaw);
    y += kStepM * std::sin(yaw);
    time += FromSeconds(kStepM / kSpeedMps);
    if (!sonar_on) return;
    GeoreferencedPing ping = swath.At(time, x, y, yaw);
    ping.bottom_lock = bottom_lock;
    if (auto submap = builder.Add(ping)) closed.push_back(*submap);
  }
  void Finish() {
    if (auto submap = builder.Finish()) closed.push_back(*submap);
  }

  SubmapBuilder builder;
  SwathMaker swath;
  std::vector<Submap> closed;
  double x = 0.0;
  double y = 0.0;
  double yaw = 0.0;
  bool sonar_on = true;
  bool bottom_lock = true;
  Time time = FromUtime(1'700'000'000'000'000);
};

}  // namespace seastitch
