#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/random.hpp"
#include "bench/sensor_errors.hpp"
#include "bench/terrain.hpp"
#include "bench/trajectory.hpp"
#include "bench/water.hpp"
#include "common/core/sensors.hpp"
#include "common/core/vehicle.hpp"

// The simulated devices. Each returns its sample for a time of the survey, in seconds since its
// start, and must be called in order of time. Samples contain no time.
namespace seastitch::bench {

// Environment that all devices measure. Must outlive them.
struct Scene {
  const Trajectory& trajectory;
  const Terrain& terrain;
  const Water& water;
  const VehicleGeometry& vehicle;
};

struct ImuParams {
  double rate_hz = 50.0;
  double latency_s = 0.002;  // from the sample to its last frame
};

// Strapdown inertial unit that computes an attitude. The gyros feel the rotation of the Earth,
// the accelerometers its Coriolis force and the normal gravity of WGS 84 at the datum.
class ImuModel {
 public:
  ImuModel(const ImuParams& params,
           const SensorErrors& errors,
           const Scene& scene,
           std::uint64_t seed);
  ImuSample SampleAt(double t_s);

 private:
  Eigen::Quaterniond AttitudeOf(const Eigen::Matrix3d& R_map_imu);
  Eigen::Vector3d White(double sigma);

  ImuParams params_;
  SensorErrors errors_;
  Scene scene_;
  Random random_;
  Eigen::Vector3d earth_rate_map_radps_;
  Eigen::Vector3d gravity_map_mps2_;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
  double heading_bias_rad_;
  double deviation_sine_rad_;
  double deviation_cosine_rad_;
  CorrelatedError roll_wander_;
  CorrelatedError pitch_wander_;
  CorrelatedError heading_wander_;
};

struct DvlParams {
  double rate_hz = 5.0;
  double beam_angle_deg = 22.5;  // from the instrument's z axis; azimuths 45, 135, 225, 315 deg
  double min_range_m = 0.3;
  double max_range_m = 80.0;
  double beam_loss_rate = 0.01;  // probability of each beam in each ensemble
  double latency_s = 0.040;
};

// Four-beam Janus DVL and the pressure sensor beside it.
class DvlModel {
 public:
  DvlModel(const DvlParams& params,
           const SensorErrors& errors,
           const Scene& scene,
           std::uint64_t seed);
  // bottom_lock: if false, all beams are lost.
  DvlSample EnsembleAt(double t_s, bool bottom_lock);
  DepthSample DepthAt(double t_s);

 private:
  std::optional<double> RangeAlong(const Eigen::Isometry3d& T_map_dvl, int beam) const;

  DvlParams params_;
  SensorErrors errors_;
  Scene scene_;
  Random random_;
  double scale_;
  Eigen::Matrix3d R_dvl_true_;  // misalignment: from true axes to stated axes
  double depth_bias_m_;
  double beam_sigma_mps_;
  Eigen::Matrix<double, 4, 3> beams_;  // unit, towards the bottom, dvl axes
};

// Errors of a sonar that its software and vehicle.yaml do not know.
struct MbesErrors {
  double roll_deg = 0.0;      // mounted so much further to starboard down, about the vehicle's axis
  double steering_mps = 0.0;  // angles are computed with a sound speed that is so much too low
  double stamp_s = 0.0;       // stamps are so much too early
  double roll_percent = 0.0;  // it rolls so much more than the vehicle
  double heave_percent = 0.0;      // it heaves so much more than the vehicle
  double beam_bias_percent = 0.0;  // of the range, constant for each beam, 1 sigma over the beams
};

struct MbesParams {
  int beams = 128;
  double swath_deg = 120.0;
  bool equidistant = true;    // soundings evenly across; else evenly in angle
  double ping_rate_hz = 5.0;  // 0: as fast as the range allows, up to max_ping_rate_hz
  double max_ping_rate_hz = 25.0;
  double max_range_m = 100.0;
  bool roll_stabilised = false;
  // Transmit sectors from port to starboard.
  std::vector<double> sector_tilt_deg{0.0};
  std::vector<double> sector_delay_s{0.0};
  // Errors of a detection: range, and angle at nadir (it grows with 1 / cos).
  double range_noise_m = 0.01;
  double range_noise_ratio = 0.001;
  double angle_noise_deg = 0.05;
  double outlier_rate = 0.002;  // single beams at a wrong range
  double drop_rate = 0.01;      // beams without a detection
  // pings with several neighbouring beams at the nearest range: side lobes
  double misdetection_rate = 0.005;
  double latency_s = 0.010;  // after the last echo
  MbesErrors errors;
};

class MbesModel {
 public:
  MbesModel(const MbesParams& params, const Scene& scene, std::uint64_t seed);

  struct Ping {
    MbesPing ping;
    double last_echo_s = 0.0;  // after the ping's time
    double next_ping_s = 0.0;  // after the ping's time, by the rate
  };
  Ping PingAt(double t_s);

 private:
  struct Sector {
    Eigen::Isometry3d T_map_sonar;  // at its transmit pulse
    double tilt_rad;
    double delay_s;
    double roll_rad;  // roll of the sonar that is compensated
  };
  // Pose of the sonar at a time of its clock.
  Eigen::Isometry3d SonarAt(double t_s) const;
  double HeaveAt(double t_s) const;
  std::vector<Sector> SectorsAt(double t_s) const;
  double NominalAngle(int beam) const;
  double AsComputed(double angle_rad, double c) const;
  MbesBeam Listen(double t_s, const Sector& sector, double angle_rad);
  void AddMisdetections(std::vector<MbesBeam>* beams);
  void FillRejected(std::vector<MbesBeam>* beams) const;

  MbesParams params_;
  Scene scene_;
  Random random_;
  Random blunder_;
  std::vector<double> beam_bias_;  // of the range
};

// GPS or USBL.
struct FixParams {
  double interval_s = 0.0;  // 0: none
  bool gps = false;  // true: only while the vehicle is at the surface; false: USBL, all the time
  double sigma_m = 2.0;  // north and east, independent in each fix
  // Error of north and east that wanders (Gauss-Markov), as a receiver's does with the satellites
  // and the air. A fix states sigma_m and wander_m together.
  double wander_m = 0.0;
  double wander_s = 120.0;  // correlation time
  // fraction of fixes that are off by wrong_m in a random direction, with the usual stated sigma
  double wrong_rate = 0.0;
  double wrong_m = 100.0;
};

class FixModel {
 public:
  FixModel(const FixParams& params, const Scene& scene, std::uint64_t seed)
      : params_(params),
        scene_(scene),
        random_(seed, "position fixes"),
        wander_random_(seed, "wander of position fixes") {}
  // Time of the first fix after t_s; nothing after the last.
  std::optional<double> TimeAfter(double t_s) const;
  PositionFix FixAt(double t_s);

 private:
  FixParams params_;
  Scene scene_;
  Random random_;
  Random wander_random_;
  CorrelatedError wander_north_{params_.wander_m, params_.wander_s, &wander_random_};
  CorrelatedError wander_east_{params_.wander_m, params_.wander_s, &wander_random_};
  double last_s_ = 0.0;
};

}  // namespace seastitch::bench
