#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/path.hpp"
#include "bench/sensor_errors.hpp"
#include "mapper/navigation/navigation_params.hpp"

// Dead reckoning against the bench's truth, many times over, each time with its own draw of every
// sensor error and of the vehicle's motion.
namespace seastitch::test {

// What a navigator who has the data sheets of the bench's sensors would configure.
NavigationParams ParamsOf(const bench::SensorErrors& errors);

struct MonteCarloCase {
  bench::PlanParams plan;
  bench::SensorErrors errors;
  NavigationParams params;  // start_sigma_m: that by which the configured start is off
  // Relative poses between submaps: at these parts of the dive.
  std::vector<std::array<double, 2>> pairs;

  // Every sensor silent. What the vehicle does meanwhile is drawn by what navigation assumes of it:
  // it ends coast_speed_sigma_mps times the silence, 1 sigma, off where it would have been.
  struct Silence {
    double at = 0.0;  // part of the dive
    double length_s = 0.0;
    bool restart = false;  // of the program, meanwhile; it knows the frame of the first pair
  };
  std::optional<Silence> silence;
};

// A straight leg, and lines to and fro.
bench::PlanParams StraightPlan(double length_m);
bench::PlanParams LawnMowerPlan(double length_m, int lines);

// Sums over runs of error^T covariance^-1 error: chi-square with runs * 3 degrees of freedom, where
// the covariance is honest.
struct MonteCarloResult {
  int runs = 0;
  double distance_m = 0.0;     // through the water, each run
  double position_nees = 0.0;  // north, east, down, at the end
  // The same error along the first line, across it and down, each over its sigma: mean over runs of
  // it and of its square. Honest and without bias: 0 and 1.
  Eigen::Vector3d mean_by_sigma = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_square_by_sigma = Eigen::Vector3d::Zero();
  double attitude_nees = 0.0;         // roll, pitch, yaw, at the end
  std::vector<double> relative_nees;  // x, y, yaw, by pair
  // RMS of the horizontal error at the end, in % of the distance travelled; the start's own error
  // is taken off. And the same as the filter states it.
  double drift_percent = 0.0;
  double stated_drift_percent = 0.0;
  double dvl_nis = 0.0;  // mean of innovation^2 / variance
};

// Runs seeds first_seed to first_seed + runs - 1. Throws std::runtime_error where a run has no
// state at its end.
MonteCarloResult RunMonteCarlo(const MonteCarloCase& c, int runs, std::uint64_t first_seed);

// The central part `confidence` (0.95, 0.999) of chi-square with n degrees of freedom, divided by n
// (Wilson and Hilferty).
struct Band {
  double low;
  double high;
};
Band Band95(double n);
Band Band999(double n);

}  // namespace seastitch::test
