#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/path.hpp"
#include "bench/terrain.hpp"

namespace seastitch::bench {

// Motion of the vehicle about its course: each a sum of sines with random phases and this RMS.
struct MotionParams {
  double roll_rms_deg = 1.0;
  double pitch_rms_deg = 0.7;
  double heading_rms_deg = 1.0;  // heading relative to the course (crab)
  double heave_rms_m = 0.05;
  double period_s = 6.0;  // middle period; periods are from half to twice it
};

// The true state of the vehicle's reference point. Map axes are fixed to the Earth.
struct TrueState {
  Eigen::Isometry3d T_map_vehicle = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_map_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_map_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_vehicle_radps = Eigen::Vector3d::Zero();    // relative to the map
  Eigen::Vector3d accel_vehicle_radps2 = Eigen::Vector3d::Zero();  // derivative of the rate
};

// The vehicle's motion as functions of time with exact derivatives.
class Trajectory {
 public:
  // The altitude is kept above the seabed under the track, smoothed over smoothing_s. Over unknown
  // seabed the depth is kept.
  Trajectory(const Path& path,
             const PlanParams& plan,
             const MotionParams& motion,
             const Terrain& terrain,
             std::uint64_t seed);

  Eigen::Isometry3d PoseAt(double t_s) const;
  TrueState StateAt(double t_s) const;
  double duration_s() const { return path_.duration_s(); }
  const Path& path() const { return path_; }

 private:
  struct Sine {
    double amplitude;
    double frequency_radps;
    double phase_rad;
  };
  struct Motion {
    double value = 0.0;
    double rate = 0.0;
    double accel = 0.0;
  };
  using Sines = std::vector<Sine>;
  static Sines MakeSines(double rms, double period_s, std::uint64_t seed, const char* name);
  static Motion Sum(const Sines& sines, double t_s);
  Motion CruiseDepthAt(double t_s) const;
  struct Attitude {
    Motion roll;
    Motion pitch;
    Motion yaw;
  };
  Attitude AttitudeAt(double t_s) const;
  Eigen::Vector3d RateAt(double t_s) const;
  void PlanDepth(const PlanParams& plan, const Terrain& terrain);

  Path path_;
  Sines roll_;
  Sines pitch_;
  Sines heading_;
  Sines heave_;
  std::vector<double> depth_knots_m_;  // of a uniform cubic B-spline
};

}  // namespace seastitch::bench
