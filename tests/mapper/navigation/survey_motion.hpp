#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/vehicle.hpp"
#include "mapper/navigation/dead_reckoning.hpp"

// A vehicle whose motion is known in closed form and whose sensors err exactly as NavigationParams
// says. Everything but the sensors' errors is worked out by differencing the closed form, with
// nothing from the library's own mechanisation but the Earth's constants.
namespace seastitch::test {

constexpr double kLatitudeRad = 0.95;
const Eigen::Vector3d kGravityMps2(0.0, 0.0, 9.81458655);  // Somigliana at kLatitudeRad
const Eigen::Vector3d kEarthRateRadps =
    7.292115e-5 * Eigen::Vector3d(std::cos(kLatitudeRad), 0.0, -std::sin(kLatitudeRad));

// Turns: heading goes by angle_rad within duration_s from start_s, smoothly.
struct Turn {
  double start_s;
  double duration_s;
  double angle_rad;
};

struct Motion {
  double speed_mps = 1.5;
  double heading_rad = 0.0;
  std::vector<Turn> turns;
  double roll_amplitude_rad = Deg2Rad(3.0);
  double pitch_amplitude_rad = Deg2Rad(2.0);
  double heave_amplitude_m = 0.2;
  double depth_m = 20.0;

  double Heading(double t) const;
  Eigen::Matrix3d R_map_vehicle(double t) const;
  Eigen::Vector3d Velocity(double t) const;  // map
};

// Four legs of leg_s with 90 degree turns, ending where it began.
Motion ClosedSquare(double leg_s);
// Parallel legs of leg_s joined by two 90 degree turns.
Motion LawnMower(double leg_s, int legs);

VehicleGeometry TestVehicle();

struct TruthState {
  double t;
  Eigen::Isometry3d T_map_vehicle;
  Eigen::Vector3d v_map_mps;
  ImuSample imu;  // without errors
  Eigen::Vector3d v_dvl_mps;
  double port_depth_m;
};

// The truth every 1 / imu_hz from 0 to duration_s.
std::vector<TruthState> Truth(const Motion& motion,
                              const VehicleGeometry& vehicle,
                              double duration_s,
                              double imu_hz);

constexpr std::int64_t kStartUtime = 1'700'000'000'000'000;
inline Time At(double t) { return FromUtime(kStartUtime) + FromSeconds(t); }

// Errors drawn once a run, at the class that params states; `scale` 0 gives perfect sensors.
class Sensors {
 public:
  Sensors(const NavigationParams& params, double imu_hz, std::uint32_t seed, double scale = 1.0);

  // The next samples, in order of time. Called once for each truth state, in order.
  ImuSample Imu(const TruthState& truth);
  DvlSample Dvl(const TruthState& truth);
  DepthSample Depth(const TruthState& truth);

  // Overrides, for tests that want one known error.
  double dvl_scale = 0.0;
  Eigen::Vector3d dvl_mounting_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d attitude_bias_rad = Eigen::Vector3d::Zero();  // roll, pitch, yaw

 private:
  double Normal() { return scale_ * normal_(random_); }
  Eigen::Vector3d Normal3() { return {Normal(), Normal(), Normal()}; }
  void Wander(double dt_s);

  NavigationParams params_;
  double dt_s_;
  double scale_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_ = Eigen::Vector3d::Zero();
  double depth_bias_m_ = 0.0;
};

// Feeds a whole run: IMU at each truth state, DVL every dvl_every-th, depth every depth_every-th.
struct RunOptions {
  int dvl_every = 20;
  int depth_every = 10;
  // No bottom lock within [from, to).
  double outage_from_s = -1.0;
  double outage_to_s = -1.0;
};
void Feed(const std::vector<TruthState>& truth,
          const RunOptions& options,
          Sensors* sensors,
          DeadReckoning* navigation);

}  // namespace seastitch::test
