#include "tests/mapper/navigation/survey_motion.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch::test {
namespace {

// From 0 to 1 with the first two derivatives zero at both ends.
double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

Eigen::Vector3d RotationVector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

}  // namespace

double Motion::Heading(double t) const {
  double heading = heading_rad;
  for (const Turn& turn : turns)
    heading += turn.angle_rad * SmoothStep((t - turn.start_s) / turn.duration_s);
  return heading;
}

Eigen::Matrix3d Motion::R_map_vehicle(double t) const {
  return RotationFromRpy(roll_amplitude_rad * std::sin(0.9 * t),
                         pitch_amplitude_rad * std::sin(0.6 * t + 0.5),
                         Heading(t));
}

Eigen::Vector3d Motion::Velocity(double t) const {
  const double heading = Heading(t);
  return {speed_mps * std::cos(heading),
          speed_mps * std::sin(heading),
          0.5 * heave_amplitude_m * std::cos(0.5 * t)};
}

Motion ClosedSquare(double leg_s) {
  Motion motion;
  for (int i = 0; i < 4; ++i) motion.turns.push_back({(i + 1) * leg_s - 20.0, 20.0, kPi / 2.0});
  return motion;
}

Motion LawnMower(double leg_s, int legs) {
  Motion motion;
  for (int i = 0; i + 1 < legs; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    motion.turns.push_back({(i + 1) * leg_s - 45.0, 20.0, side * kPi / 2.0});
    motion.turns.push_back({(i + 1) * leg_s - 22.0, 20.0, side * kPi / 2.0});
  }
  return motion;
}

VehicleGeometry TestVehicle() {
  VehicleGeometry vehicle;
  vehicle.datum.latitude_rad = kLatitudeRad;
  vehicle.datum.longitude_rad = 0.2;
  vehicle.T_vehicle_imu = MakePose({0.4, 0.1, -0.2}, RotationFromRpy(0.02, -0.03, 0.05));
  vehicle.T_vehicle_dvl = MakePose({-0.8, 0.0, 0.3}, RotationFromRpy(0.0, 0.0, kPi / 4.0));
  vehicle.p_vehicle_depth_m = {1.0, 0.1, -0.1};
  return vehicle;
}

std::vector<TruthState> Truth(const Motion& motion,
                              const VehicleGeometry& vehicle,
                              double duration_s,
                              double imu_hz) {
  const auto R = [&](double t) { return motion.R_map_vehicle(t); };
  constexpr double kStep = 1e-4;
  // Velocity of a point of the vehicle, and its acceleration.
  const auto v_of = [&](double t, const Eigen::Vector3d& p_vehicle) -> Eigen::Vector3d {
    return motion.Velocity(t) + (R(t + kStep) - R(t - kStep)) * p_vehicle / (2.0 * kStep);
  };
  const Eigen::Vector3d p_imu = vehicle.T_vehicle_imu.translation();
  const Eigen::Matrix3d R_imu_vehicle = vehicle.T_vehicle_imu.linear().transpose();

  std::vector<TruthState> truth;
  Eigen::Vector3d p(0.0, 0.0, motion.depth_m);
  const int count = static_cast<int>(std::lround(duration_s * imu_hz));
  for (int i = 0; i <= count; ++i) {
    const double t = i / imu_hz;
    if (i > 0) {
      const double dt = 1.0 / imu_hz;
      p += dt / 6.0 *
           (motion.Velocity(t - dt) + 4.0 * motion.Velocity(t - dt / 2.0) + motion.Velocity(t));
    }
    TruthState state;
    state.t = t;
    state.T_map_vehicle = MakePose(p, R(t));
    state.v_map_mps = motion.Velocity(t);

    const Eigen::Vector3d turn =
        RotationVector(R(t - kStep).transpose() * R(t + kStep)) / (2.0 * kStep);
    constexpr double kLong = 1e-3;
    const Eigen::Vector3d a_imu = (v_of(t + kLong, p_imu) - v_of(t - kLong, p_imu)) / (2.0 * kLong);
    const Eigen::Vector3d v_imu = v_of(t, p_imu);
    state.imu.time = At(t);
    state.imu.angular_rate_radps = R_imu_vehicle * (turn + R(t).transpose() * kEarthRateRadps);
    state.imu.specific_force_mps2 = R_imu_vehicle * R(t).transpose() *
                                    (a_imu + 2.0 * kEarthRateRadps.cross(v_imu) - kGravityMps2);
    Attitude attitude;
    attitude.q_ned_imu = Eigen::Quaterniond(R(t) * vehicle.T_vehicle_imu.linear());
    state.imu.attitude = attitude;

    const Eigen::Isometry3d& T_vehicle_dvl = vehicle.T_vehicle_dvl;
    state.v_dvl_mps = T_vehicle_dvl.linear().transpose() * R(t).transpose() *
                      v_of(t, T_vehicle_dvl.translation());
    state.port_depth_m = (p + R(t) * vehicle.p_vehicle_depth_m).z();
    truth.push_back(state);
  }
  return truth;
}

Sensors::Sensors(const NavigationParams& params, double imu_hz, std::uint32_t seed, double scale)
    : params_(params), dt_s_(1.0 / imu_hz), scale_(scale), random_(seed) {
  gyro_bias_ = params.gyro_bias_radps.sigma * Normal3();
  accel_bias_ = params.accel_bias_mps2.sigma * Normal3();
  dvl_scale = params.dvl_scale.sigma * Normal();
  dvl_mounting_rad = params.dvl_mounting_rad.sigma * Normal3();
  attitude_bias_rad << params.attitude_roll_pitch_rad.sigma.x() * Normal(),
      params.attitude_roll_pitch_rad.sigma.y() * Normal(),
      params.attitude_heading_rad.sigma * Normal();
  depth_bias_m_ = params.depth_bias_m.sigma * Normal();
}

void Sensors::Wander(double dt_s) {
  if (scale_ == 0.0) return;
  const auto step = [&](double* value, double sigma, double tau_s) {
    const double keep = std::exp(-dt_s / tau_s);
    *value = keep * *value + sigma * std::sqrt(1.0 - keep * keep) * Normal();
  };
  for (int i = 0; i < 3; ++i) {
    step(&gyro_bias_(i), params_.gyro_bias_radps.sigma, params_.gyro_bias_radps.tau_s);
    step(&accel_bias_(i), params_.accel_bias_mps2.sigma, params_.accel_bias_mps2.tau_s);
    step(&dvl_mounting_rad(i), params_.dvl_mounting_rad.sigma, params_.dvl_mounting_rad.tau_s);
  }
  for (int i = 0; i < 2; ++i)
    step(&attitude_bias_rad(i),
         params_.attitude_roll_pitch_rad.sigma(i),
         params_.attitude_roll_pitch_rad.tau_s);
  step(&attitude_bias_rad(2),
       params_.attitude_heading_rad.sigma,
       params_.attitude_heading_rad.tau_s);
  step(&dvl_scale, params_.dvl_scale.sigma, params_.dvl_scale.tau_s);
}

ImuSample Sensors::Imu(const TruthState& truth) {
  Wander(dt_s_);
  ImuSample imu = truth.imu;
  imu.angular_rate_radps +=
      gyro_bias_ + params_.gyro_noise_radps_rthz / std::sqrt(dt_s_) * Normal3();
  imu.specific_force_mps2 +=
      accel_bias_ + params_.accel_noise_mps2_rthz / std::sqrt(dt_s_) * Normal3();
  const Eigen::Vector3d rpy = RpyFromRotation(imu.attitude->q_ned_imu.toRotationMatrix()) +
                              attitude_bias_rad +
                              params_.attitude_white_rad.cwiseProduct(Normal3());
  imu.attitude->q_ned_imu = Eigen::Quaterniond(RotationFromRpy(rpy.x(), rpy.y(), rpy.z()));
  return imu;
}

DvlSample Sensors::Dvl(const TruthState& truth) {
  DvlSample dvl;
  dvl.time = At(truth.t);
  dvl.bottom_lock = true;
  const Eigen::AngleAxisd mounting(dvl_mounting_rad.norm(), dvl_mounting_rad.stableNormalized());
  dvl.v_dvl_mps =
      (1.0 + dvl_scale) * (mounting * truth.v_dvl_mps) + params_.dvl_sigma_mps * Normal3();
  dvl.sigma_v_mps.setConstant(params_.dvl_sigma_mps);
  return dvl;
}

DepthSample Sensors::Depth(const TruthState& truth) {
  DepthSample depth;
  depth.time = At(truth.t);
  depth.depth_m = truth.port_depth_m + depth_bias_m_ + params_.depth_sigma_m * Normal();
  depth.sigma_m = params_.depth_sigma_m;
  return depth;
}

void Feed(const std::vector<TruthState>& truth,
          const RunOptions& options,
          Sensors* sensors,
          DeadReckoning* navigation) {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    navigation->Add(sensors->Imu(truth[i]));
    if (static_cast<int>(i) % options.depth_every == 0) navigation->Add(sensors->Depth(truth[i]));
    if (static_cast<int>(i) % options.dvl_every != 0) continue;
    DvlSample dvl = sensors->Dvl(truth[i]);
    if (truth[i].t >= options.outage_from_s && truth[i].t < options.outage_to_s) {
      dvl.bottom_lock = false;
      dvl.v_dvl_mps.setZero();
      dvl.sigma_v_mps.setZero();
    }
    navigation->Add(dvl);
  }
  navigation->Finish();
}

}  // namespace seastitch::test
