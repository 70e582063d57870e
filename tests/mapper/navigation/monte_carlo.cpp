#include "tests/mapper/navigation/monte_carlo.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>

#include "bench/sensor_models.hpp"
#include "bench/simulator.hpp"
#include "common/core/pose.hpp"
#include "mapper/navigation/dead_reckoning.hpp"

namespace seastitch::test {
namespace {

constexpr double kImuHz = 50.0;
constexpr int kDvlEvery = 10;  // 5 Hz
constexpr double kForeverS = 1e6;

Time At(double t_s) { return bench::kSurveyStart + FromSeconds(t_s); }

VehicleGeometry Vehicle() {
  VehicleGeometry vehicle;
  vehicle.datum.latitude_rad = 0.75;
  vehicle.T_vehicle_imu = MakePose({0.2, 0.0, -0.05}, RotationFromRpy(0.01, -0.02, 0.0));
  vehicle.T_vehicle_dvl = MakePose({-0.6, 0.0, 0.15}, RotationFromRpy(0.0, 0.0, kPi / 4.0));
  vehicle.p_vehicle_depth_m = {-0.1, 0.05, 0.0};
  return vehicle;
}

double Nees(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  return error.dot(covariance.llt().solve(error));
}

Eigen::Vector3d RpyError(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth) {
  Eigen::Vector3d error = RpyFromRotation(estimate.linear()) - RpyFromRotation(truth.linear());
  error.z() = WrapAngle(error.z());
  return error;
}

struct Run {
  Run(const MonteCarloCase& c, std::uint64_t seed)
      : path(c.plan),
        trajectory(path, c.plan, {}, seabed, seed),
        navigation(Start(c, seed), vehicle) {
    const bench::Scene scene{trajectory, seabed, water, vehicle};
    bench::ImuModel imu(bench::ImuParams{kImuHz, 0.0}, c.errors, scene, seed);
    bench::DvlModel dvl(bench::DvlParams{}, c.errors, scene, seed);
    const int samples = static_cast<int>(trajectory.duration_s() * kImuHz);
    if (c.silence) BeSilent(c, seed);
    for (int i = 0; i <= samples; ++i) {
      const double t = i / kImuHz;
      if (t >= silent_from_s && t < silent_to_s) continue;
      if (c.silence && c.silence->restart && !state_before && t >= silent_to_s)
        Restart(c, seed, c.pairs[0][0] * (samples / kImuHz));
      ImuSample sample = imu.SampleAt(t);
      sample.time = At(t);
      navigation.Add(sample);
      if (i % kDvlEvery != 0) continue;
      DvlSample ensemble = dvl.EnsembleAt(t, true);
      ensemble.time = At(t);
      navigation.Add(ensemble);
      DepthSample depth = dvl.DepthAt(t);
      depth.time = At(t);
      navigation.Add(depth);
    }
    navigation.Finish();
    end_s = samples / kImuHz;
    if (!state_before) FindFirst(end_s);
    if (!navigation.StateAt(At(end_s))) throw std::runtime_error("no state at the end of a run");
  }

  NavigationParams Start(const MonteCarloCase& c, std::uint64_t seed) const {
    std::mt19937_64 random(seed ^ 0x5ea57a27u);
    std::normal_distribution<double> normal(0.0, c.params.start_sigma_m);
    NavigationParams params = c.params;
    params.start_north_m = normal(random);
    params.start_east_m = normal(random);
    return params;
  }

  // The start is known as of the first state, not as of the first sample.
  void FindFirst(double until_s) {
    while (!navigation.StateAt(At(first_s)) && first_s < until_s) first_s += 1.0 / kImuHz;
  }

  void BeSilent(const MonteCarloCase& c, std::uint64_t seed) {
    silent_from_s = c.silence->at * trajectory.duration_s();
    silent_to_s = silent_from_s + c.silence->length_s;
    std::mt19937_64 random(seed ^ 0x517e9ceu);
    std::normal_distribution<double> normal(0.0,
                                            c.params.coast_speed_sigma_mps * c.silence->length_s);
    drifted_m.x() = normal(random);
    drifted_m.y() = normal(random);
  }

  void Restart(const MonteCarloCase& c, std::uint64_t seed, double since_s) {
    FindFirst(since_s);
    state_before = *navigation.StateAt(At(since_s));
    const auto saved = navigation.Save(At(since_s));
    navigation = DeadReckoning(Start(c, seed), vehicle);
    if (!saved || !navigation.Restore(*saved)) throw std::runtime_error("not restored");
  }

  NavState StateAt(double t_s) const {
    if (state_before && At(t_s) == state_before->time) return *state_before;
    return *navigation.StateAt(At(t_s));
  }
  Eigen::Isometry3d TruthAt(double t_s) const {
    Eigen::Isometry3d truth = trajectory.PoseAt(t_s);
    if (t_s >= silent_to_s) truth.translation() += drifted_m;
    return truth;
  }

  // Less what the vehicle had moved before the first state.
  Eigen::Vector3d PositionError(double t_s) const {
    Eigen::Vector3d before =
        trajectory.PoseAt(first_s).translation() - trajectory.PoseAt(0.0).translation();
    before.z() = 0.0;
    return StateAt(t_s).T_map_vehicle.translation() + before - TruthAt(t_s).translation();
  }

  double RelativeNees(double a_s, double b_s) const {
    const auto between = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
      return Inverse(LevelPose(a)) * LevelPose(b);
    };
    const Pose2 estimate = between(StateAt(a_s).T_map_vehicle, StateAt(b_s).T_map_vehicle);
    const Pose2 truth = between(TruthAt(a_s), TruthAt(b_s));
    Eigen::Vector3d error = estimate.Vector() - truth.Vector();
    error.z() = WrapAngle(error.z());
    return Nees(error, *navigation.RelativeCovariance(At(a_s), At(b_s)));
  }

  VehicleGeometry vehicle = Vehicle();
  bench::ProceduralTerrain seabed{{}, 1};
  bench::Water water{{}};
  bench::Path path;
  bench::Trajectory trajectory;
  DeadReckoning navigation;
  double first_s = 0.0;
  double end_s = 0.0;
  double silent_from_s = kForeverS;
  double silent_to_s = kForeverS;
  Eigen::Vector3d drifted_m = Eigen::Vector3d::Zero();
  std::optional<NavState> state_before;  // of the first pair, where the program was restarted
};

Band BandOf(double n, double z) {
  const double c = 2.0 / (9.0 * n);
  return {std::pow(1.0 - c - z * std::sqrt(c), 3), std::pow(1.0 - c + z * std::sqrt(c), 3)};
}

}  // namespace

Band Band95(double n) { return BandOf(n, 1.960); }
Band Band999(double n) { return BandOf(n, 3.291); }

NavigationParams ParamsOf(const bench::SensorErrors& errors) {
  NavigationParams params;
  params.gyro_noise_radps_rthz = errors.gyro_noise_radps_rthz;
  params.accel_noise_mps2_rthz = errors.accel_noise_mps2_rthz;
  params.gyro_bias_radps = {errors.gyro_bias_radps, kForeverS};
  params.accel_bias_mps2 = {errors.accel_bias_mps2, kForeverS};
  const double tilt = Deg2Rad(errors.roll_pitch_wander_deg);
  params.attitude_roll_pitch_rad = {{tilt, tilt}, errors.roll_pitch_wander_tau_s};
  params.attitude_heading_rad = {Deg2Rad(errors.heading_bias_deg), kForeverS};
  params.attitude_heading_wander_rad = {Deg2Rad(errors.heading_wander_deg),
                                        errors.heading_wander_tau_s};
  params.attitude_deviation_rad = Deg2Rad(errors.heading_deviation_deg);
  params.attitude_white_rad.setConstant(Deg2Rad(errors.attitude_white_deg));
  params.dvl_sigma_mps = errors.dvl_noise_mps;
  params.dvl_sigma_floor_mps = 1e-4;  // the simulated instrument tells the truth about itself
  params.dvl_scale = {errors.dvl_scale, kForeverS};
  params.dvl_mounting_rad = {Deg2Rad(errors.dvl_misalignment_deg), kForeverS};
  params.depth_sigma_m = errors.depth_noise_m;
  params.depth_bias_m = {errors.depth_bias_m, kForeverS};
  params.attitude_time_sigma_s = params.dvl_time_sigma_s = 0.0;  // stamps are exact
  params.start_sigma_m = 0.5;
  params.window_s = 3600.0;
  return params;
}

bench::PlanParams StraightPlan(double length_m) {
  bench::PlanParams plan;
  plan.lines = 1;
  plan.line_length_m = length_m;
  plan.crosslines = 0;
  plan.heading_deg = 30.0;
  return plan;
}

bench::PlanParams LawnMowerPlan(double length_m, int lines) {
  bench::PlanParams plan = StraightPlan(length_m / lines);
  plan.lines = lines;
  return plan;
}

MonteCarloResult RunMonteCarlo(const MonteCarloCase& c, int runs, std::uint64_t first_seed) {
  const Eigen::Matrix3d R_line_map =
      RotationFromRpy(0.0, 0.0, Deg2Rad(c.plan.heading_deg)).transpose();
  MonteCarloResult result;
  result.runs = runs;
  result.relative_nees.resize(c.pairs.size());
  double drift2 = 0.0;
  double stated2 = 0.0;
  for (int i = 0; i < runs; ++i) {
    const Run run(c, first_seed + static_cast<std::uint64_t>(i));
    const NavState end = *run.navigation.StateAt(At(run.end_s));
    const Eigen::Vector3d p_error = run.PositionError(run.end_s);
    const Eigen::Matrix3d p_covariance = end.covariance.topLeftCorner<3, 3>();
    result.position_nees += Nees(p_error, p_covariance);
    const Eigen::Vector3d by_sigma =
        (R_line_map * p_error)
            .cwiseQuotient(
                (R_line_map * p_covariance * R_line_map.transpose()).diagonal().cwiseSqrt());
    result.mean_by_sigma += by_sigma / runs;
    result.mean_square_by_sigma += by_sigma.cwiseAbs2() / runs;
    result.attitude_nees += Nees(RpyError(end.T_map_vehicle, run.trajectory.PoseAt(run.end_s)),
                                 end.covariance.bottomRightCorner<3, 3>());
    for (std::size_t k = 0; k < c.pairs.size(); ++k)
      result.relative_nees[k] += run.RelativeNees(
          std::max(c.pairs[k][0] * run.end_s, run.first_s + 1.0), c.pairs[k][1] * run.end_s);
    result.distance_m = run.path.duration_s() * run.path.speed_mps();
    drift2 += (p_error - run.PositionError(run.first_s)).head<2>().squaredNorm();
    const double start_variance = 2.0 * c.params.start_sigma_m * c.params.start_sigma_m;
    stated2 += end.covariance.topLeftCorner<2, 2>().trace() - start_variance;
    result.dvl_nis += run.navigation.innovations(NavSensor::kDvl).mean_nis / runs;
  }
  result.drift_percent = 100.0 * std::sqrt(drift2 / runs) / result.distance_m;
  result.stated_drift_percent = 100.0 * std::sqrt(stated2 / runs) / result.distance_m;
  return result;
}

}  // namespace seastitch::test
