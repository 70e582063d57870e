#pragma once

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <cstdio>
#include <random>
#include <variant>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"

// Samples of an INS, for the tests of its navigation.
namespace seastitch {

using Rng = std::mt19937_64;

inline double Normal(Rng* rng) { return std::normal_distribution<double>()(*rng); }

inline const GeographicLib::LocalCartesian& ToMap() {
  static const GeographicLib::LocalCartesian to_map(0.0, 0.0, 0.0);
  return to_map;
}

inline NavigationSample SampleOf(double t_s,
                                 const Eigen::Vector2d& north_east_m,
                                 double yaw_rad,
                                 const std::optional<Eigen::Vector2d>& v_mps) {
  NavigationSample sample;
  sample.time = FromUtime(1'700'000'000'000'000) + FromSeconds(t_s);
  double latitude_deg = 0.0, longitude_deg = 0.0, height_m = 0.0;
  ToMap().Reverse(north_east_m.y(), north_east_m.x(), 0.0, latitude_deg, longitude_deg, height_m);
  sample.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg), {0.0, 0.0}};
  sample.depth = InsVertical{10.0, 0.0};
  sample.attitude = Attitude{Eigen::Quaterniond(RotationFromRpy(0.0, 0.0, yaw_rad))};
  if (v_mps) sample.velocity = GeoVelocity{{v_mps->x(), v_mps->y(), 0.0}};
  return sample;
}

inline Time At(double t_s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(t_s); }

// Lines of 200 s at 2 m/s, north and south in turn, with turns of 20 s.
inline double TrueYaw(double t_s) {
  constexpr double kLine = 200.0, kTurn = 20.0;
  const double legs = std::floor(t_s / (kLine + kTurn));
  const double in_leg = t_s - legs * (kLine + kTurn);
  const double turned = std::clamp((in_leg - kLine) / kTurn, 0.0, 1.0);
  const bool south = std::fmod(legs, 2.0) != 0.0;
  return south ? kPi * (1.0 - turned) : kPi * turned;
}

}  // namespace seastitch
