#include "bench/sensor_models.hpp"

#include <Eigen/QR>
#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/core/pose.hpp"

namespace seastitch::bench {
namespace {

// WGS 84: rotation rate, equatorial gravity, Somigliana's constant, first eccentricity squared.
constexpr double kEarthRateRadps = 7.292115e-5;
constexpr double kGravityEquator = 9.7803253359;
constexpr double kSomigliana = 0.00193185265241;
constexpr double kEccentricity2 = 0.00669437999013;
constexpr double kSeaWaterKgpm3 = 1025.0;

double NormalGravity(double latitude_rad) {
  const double s2 = std::sin(latitude_rad) * std::sin(latitude_rad);
  return kGravityEquator * (1.0 + kSomigliana * s2) / std::sqrt(1.0 - kEccentricity2 * s2);
}

Eigen::Vector3d NormalVector(double sigma, Random* random) {
  const double x = random->Normal();
  const double y = random->Normal();
  const double z = random->Normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

}  // namespace

ImuModel::ImuModel(const ImuParams& params,
                   const SensorErrors& errors,
                   const Scene& scene,
                   std::uint64_t seed)
    : params_(params),
      errors_(errors),
      scene_(scene),
      random_(seed, "imu"),
      gyro_bias_(NormalVector(errors.gyro_bias_radps, &random_)),
      accel_bias_(NormalVector(errors.accel_bias_mps2, &random_)),
      heading_bias_rad_(Deg2Rad(errors.heading_bias_deg) * random_.Normal()),
      deviation_sine_rad_(Deg2Rad(errors.heading_deviation_deg) * random_.Normal()),
      deviation_cosine_rad_(Deg2Rad(errors.heading_deviation_deg) * random_.Normal()),
      roll_wander_(Deg2Rad(errors.roll_pitch_wander_deg), errors.roll_pitch_wander_tau_s, &random_),
      pitch_wander_(
          Deg2Rad(errors.roll_pitch_wander_deg), errors.roll_pitch_wander_tau_s, &random_),
      heading_wander_(Deg2Rad(errors.heading_wander_deg), errors.heading_wander_tau_s, &random_) {
  const double latitude = scene.vehicle.datum.latitude_rad;
  earth_rate_map_radps_ =
      kEarthRateRadps * Eigen::Vector3d(std::cos(latitude), 0.0, -std::sin(latitude));
  gravity_map_mps2_ = {0.0, 0.0, NormalGravity(latitude)};
}

Eigen::Vector3d ImuModel::White(double sigma) { return NormalVector(sigma, &random_); }

ImuSample ImuModel::SampleAt(double t_s) {
  const TrueState state = scene_.trajectory.StateAt(t_s);
  const Eigen::Isometry3d& T_vehicle_imu = scene_.vehicle.T_vehicle_imu;
  const Eigen::Matrix3d R_map_vehicle = state.T_map_vehicle.linear();
  const Eigen::Matrix3d R_map_imu = R_map_vehicle * T_vehicle_imu.linear();
  const Eigen::Vector3d& w = state.rate_vehicle_radps;
  const Eigen::Vector3d arm = T_vehicle_imu.translation();
  const Eigen::Vector3d v_map = state.v_map_mps + R_map_vehicle * w.cross(arm);
  const Eigen::Vector3d a_map =
      state.a_map_mps2 +
      R_map_vehicle * (state.accel_vehicle_radps2.cross(arm) + w.cross(w.cross(arm)));
  const Eigen::Vector3d force_map =
      a_map + 2.0 * earth_rate_map_radps_.cross(v_map) - gravity_map_mps2_;
  const Eigen::Vector3d rate_map = R_map_vehicle * w + earth_rate_map_radps_;

  const double root_rate = std::sqrt(params_.rate_hz);
  ImuSample sample;
  sample.angular_rate_radps = R_map_imu.transpose() * rate_map + gyro_bias_ +
                              White(errors_.gyro_noise_radps_rthz * root_rate);
  sample.specific_force_mps2 = R_map_imu.transpose() * force_map + accel_bias_ +
                               White(errors_.accel_noise_mps2_rthz * root_rate);
  Attitude attitude;
  attitude.q_ned_imu = AttitudeOf(R_map_imu);
  const double roll_pitch_sigma = Deg2Rad(errors_.StatedRollPitchSigmaDeg());
  attitude.sigma_rpy_rad = {
      roll_pitch_sigma, roll_pitch_sigma, Deg2Rad(errors_.StatedHeadingSigmaDeg())};
  sample.attitude = attitude;
  return sample;
}

Eigen::Quaterniond ImuModel::AttitudeOf(const Eigen::Matrix3d& R_map_imu) {
  const double dt = 1.0 / params_.rate_hz;
  roll_wander_.Step(dt, &random_);
  pitch_wander_.Step(dt, &random_);
  heading_wander_.Step(dt, &random_);
  const Eigen::Vector3d rpy = RpyFromRotation(R_map_imu);
  const double heading_error = heading_bias_rad_ + heading_wander_.value() +
                               deviation_sine_rad_ * std::sin(rpy.z()) +
                               deviation_cosine_rad_ * std::cos(rpy.z());
  const Eigen::Vector3d measured =
      rpy + Eigen::Vector3d(roll_wander_.value(), pitch_wander_.value(), heading_error) +
      White(Deg2Rad(errors_.attitude_white_deg));
  return Eigen::Quaterniond(RotationFromRpy(measured.x(), measured.y(), measured.z()));
}

DvlModel::DvlModel(const DvlParams& params,
                   const SensorErrors& errors,
                   const Scene& scene,
                   std::uint64_t seed)
    : params_(params), errors_(errors), scene_(scene), random_(seed, "dvl") {
  scale_ = 1.0 + errors.dvl_scale * random_.Normal();
  const Eigen::Vector3d off = NormalVector(Deg2Rad(errors.dvl_misalignment_deg), &random_);
  R_dvl_true_ = RotationFromRpy(off.x(), off.y(), off.z());
  depth_bias_m_ = errors.depth_bias_m * random_.Normal();
  const double sine = std::sin(Deg2Rad(params.beam_angle_deg));
  const double cosine = std::cos(Deg2Rad(params.beam_angle_deg));
  // Least squares of four beams: sigma_xy = beam sigma / (sqrt(2) sine).
  beam_sigma_mps_ = errors.dvl_noise_mps * std::sqrt(2.0) * sine;
  const double side = sine * std::sqrt(0.5);
  beams_ << side, side, cosine, -side, side, cosine, -side, -side, cosine, side, -side, cosine;
}

std::optional<double> DvlModel::RangeAlong(const Eigen::Isometry3d& T_map_dvl, int beam) const {
  const Eigen::Vector3d direction = T_map_dvl.linear() * beams_.row(beam).transpose();
  const auto echo =
      scene_.water.March(scene_.terrain, T_map_dvl.translation(), direction, params_.max_range_m);
  if (!echo) return std::nullopt;
  return echo->one_way_s * scene_.water.SpeedAt(T_map_dvl.translation().z());
}

DvlSample DvlModel::EnsembleAt(double t_s, bool bottom_lock) {
  const TrueState state = scene_.trajectory.StateAt(t_s);
  const Eigen::Isometry3d& T_vehicle_dvl = scene_.vehicle.T_vehicle_dvl;
  const Eigen::Isometry3d T_map_dvl = state.T_map_vehicle * T_vehicle_dvl;
  const Eigen::Vector3d v_vehicle =
      state.T_map_vehicle.linear().transpose() * state.v_map_mps +
      state.rate_vehicle_radps.cross(Eigen::Vector3d(T_vehicle_dvl.translation()));
  const Eigen::Vector3d v_dvl =
      scale_ * (R_dvl_true_ * (T_vehicle_dvl.linear().transpose() * v_vehicle));

  DvlSample sample;
  Eigen::Matrix<double, 4, 3> used = Eigen::Matrix<double, 4, 3>::Zero();
  Eigen::Vector4d along = Eigen::Vector4d::Zero();
  int valid = 0;
  double altitude_sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    // Random numbers are drawn for lost beams too, so that a loss does not change other beams.
    const double velocity = beams_.row(i).dot(v_dvl) + beam_sigma_mps_ * random_.Normal();
    const double range_noise = errors_.dvl_range_noise_m * random_.Normal();
    const bool lost = random_.Chance(params_.beam_loss_rate);
    if (lost || !bottom_lock) continue;
    const auto range = RangeAlong(T_map_dvl, i);
    if (!range || *range < params_.min_range_m || *range > params_.max_range_m) continue;
    DvlBeam& beam = sample.beams[static_cast<std::size_t>(i)];
    beam = {true, *range + range_noise, velocity};
    used.row(i) = beams_.row(i);
    along(i) = velocity;
    ++valid;
    altitude_sum += beam.range_m * (T_map_dvl.linear() * beams_.row(i).transpose()).z();
  }
  if (valid < 3) return sample;

  const Eigen::Matrix3d normal = used.transpose() * used;
  sample.bottom_lock = true;
  sample.v_dvl_mps = normal.ldlt().solve(used.transpose() * along);
  sample.sigma_v_mps = beam_sigma_mps_ * normal.inverse().diagonal().cwiseSqrt();
  sample.altitude_m = altitude_sum / valid;
  return sample;
}

DepthSample DvlModel::DepthAt(double t_s) {
  const Eigen::Vector3d p_map = scene_.trajectory.PoseAt(t_s) * scene_.vehicle.p_vehicle_depth_m;
  DepthSample sample;
  sample.depth_m = p_map.z() + depth_bias_m_ + errors_.depth_noise_m * random_.Normal();
  sample.pressure_pa = std::max(0.0, sample.depth_m) * kSeaWaterKgpm3 *
                       NormalGravity(scene_.vehicle.datum.latitude_rad);
  sample.sigma_m = std::hypot(errors_.depth_noise_m, errors_.depth_bias_m);
  return sample;
}

MbesModel::MbesModel(const MbesParams& params, const Scene& scene, std::uint64_t seed)
    : params_(params), scene_(scene), random_(seed, "mbes"), blunder_(seed, "mbes blunders") {
  Random bias(seed, "mbes bias");
  for (int i = 0; i < params_.beams; ++i)
    beam_bias_.push_back(0.01 * params_.errors.beam_bias_percent * bias.Normal());
}

// Height of the vehicle above its mean of 20 s, down.
double MbesModel::HeaveAt(double t_s) const {
  constexpr int kSamples = 40;
  constexpr double kWindowS = 20.0;
  double mean_m = 0.0;
  for (int i = 0; i < kSamples; ++i)
    mean_m +=
        scene_.trajectory.PoseAt(t_s + ((i + 0.5) / kSamples - 0.5) * kWindowS).translation().z() /
        kSamples;
  return scene_.trajectory.PoseAt(t_s).translation().z() - mean_m;
}

Eigen::Isometry3d MbesModel::SonarAt(double t_s) const {
  const MbesErrors& e = params_.errors;
  const double true_s = t_s + e.stamp_s;
  Eigen::Isometry3d T_map_vehicle = scene_.trajectory.PoseAt(true_s);
  const double roll_rad =
      Deg2Rad(e.roll_deg) + 0.01 * e.roll_percent * RpyFromRotation(T_map_vehicle.linear()).x();
  if (e.heave_percent != 0.0)
    T_map_vehicle.translation().z() += 0.01 * e.heave_percent * HeaveAt(true_s);
  Eigen::Isometry3d T_vehicle_sonar = scene_.vehicle.T_vehicle_mbes;
  T_vehicle_sonar.linear() = RotationFromRpy(roll_rad, 0.0, 0.0) * T_vehicle_sonar.linear();
  return T_map_vehicle * T_vehicle_sonar;
}

double MbesModel::NominalAngle(int beam) const {
  const double share = 2.0 * beam / (params_.beams - 1.0) - 1.0;
  const double half = 0.5 * Deg2Rad(params_.swath_deg);
  return params_.equidistant ? std::atan(share * std::tan(half)) : share * half;
}

std::vector<MbesModel::Sector> MbesModel::SectorsAt(double t_s) const {
  std::vector<Sector> sectors;
  for (std::size_t i = 0; i < params_.sector_tilt_deg.size(); ++i) {
    Sector s;
    s.tilt_rad = Deg2Rad(params_.sector_tilt_deg[i]);
    s.delay_s = params_.sector_delay_s[i];
    s.T_map_sonar = SonarAt(t_s + s.delay_s);
    s.roll_rad = RpyFromRotation(s.T_map_sonar.linear()).x();
    sectors.push_back(s);
  }
  return sectors;
}

// Angle of an echo as the sonar computes it with its sound speed. c: the true one [m/s].
double MbesModel::AsComputed(double angle_rad, double c) const {
  if (params_.errors.steering_mps == 0.0) return angle_rad;
  const double ratio = (c - params_.errors.steering_mps) / c;
  return std::asin(std::clamp(ratio * std::sin(angle_rad), -1.0, 1.0));
}

// Travel time and receive angle of one beam. The pulse leaves on the transmit cone. The echo
// arrives at the sonar's later position.
MbesBeam MbesModel::Listen(double t_s, const Sector& sector, double angle_rad) {
  MbesBeam beam;
  beam.tx_tilt_rad = static_cast<float>(sector.tilt_rad);
  beam.tx_delay_s = static_cast<float>(sector.delay_s);
  beam.rx_angle_rad = static_cast<float>(angle_rad);
  const double range_draw = random_.Normal();
  const double angle_draw = random_.Normal();
  if (random_.Chance(params_.drop_rate)) return beam;

  const double x = std::sin(sector.tilt_rad);
  const double y = std::sin(angle_rad);
  const double z2 = 1.0 - x * x - y * y;
  if (!(z2 > 0.0)) return beam;
  const Eigen::Vector3d p_tx = sector.T_map_sonar.translation();
  const auto echo =
      scene_.water.March(scene_.terrain,
                         p_tx,
                         sector.T_map_sonar.linear() * Eigen::Vector3d(x, y, std::sqrt(z2)),
                         params_.max_range_m);
  if (!echo) return beam;
  // Time of the echo from twice the one-way time: relative error of speed / sound speed, 0.1 %.
  const Eigen::Isometry3d T_map_rx = SonarAt(t_s + sector.delay_s + 2.0 * echo->one_way_s);
  const auto back = scene_.water.Back(echo->p_map, T_map_rx.translation(), echo->snell_s_per_m);
  if (!back) return beam;

  const double c = scene_.water.SpeedAt(p_tx.z());
  const double twtt = echo->one_way_s + back->one_way_s;
  const double range = 0.5 * twtt * c;
  const double range_sigma = std::hypot(params_.range_noise_m, params_.range_noise_ratio * range);
  const double true_angle =
      std::asin(std::clamp(back->towards.dot(T_map_rx.linear().col(1)), -1.0, 1.0));
  const double angle_sigma = Deg2Rad(params_.angle_noise_deg) / std::cos(true_angle);
  beam.rx_angle_rad = static_cast<float>(AsComputed(true_angle, c) + angle_sigma * angle_draw);
  beam.twtt_s = static_cast<float>(twtt + 2.0 * range_sigma * range_draw / c);
  // Angle of the beam from the vertical.
  const double down = echo->p_map.z() - p_tx.z();
  const double sine = std::sqrt(std::max(0.0, 1.0 - (down / range) * (down / range)));
  const double depth_sigma = std::hypot(range_sigma * down / range, range * sine * angle_sigma);
  beam.depth_sigma_ratio = static_cast<float>(depth_sigma / down);
  beam.backscatter_db = static_cast<float>(-20.0 + 20.0 * std::log10(down / range));  // Lambert
  const bool steep = std::abs(true_angle) < Deg2Rad(25.0);
  beam.flags = static_cast<std::uint8_t>(kBeamValid | (steep ? kBeamAmplitude : kBeamPhase));
  if (blunder_.Chance(params_.outlier_rate))
    beam.twtt_s *= static_cast<float>(0.6 + 0.7 * blunder_.Uniform());
  return beam;
}

void MbesModel::AddMisdetections(std::vector<MbesBeam>* beams) {
  if (!blunder_.Chance(params_.misdetection_rate)) return;
  constexpr std::size_t kRun = 8;
  const std::size_t first = blunder_.Bits() % beams->size();
  float nearest = 0.0f;
  for (const MbesBeam& beam : *beams)
    if (beam.flags != 0 && (nearest == 0.0f || beam.twtt_s < nearest)) nearest = beam.twtt_s;
  for (std::size_t i = first; i < std::min(first + kRun, beams->size()); ++i)
    if ((*beams)[i].flags != 0) (*beams)[i].twtt_s = nearest;
}

// Gives rejected beams the travel time of their neighbours, and flags them.
void MbesModel::FillRejected(std::vector<MbesBeam>* beams) const {
  float near = static_cast<float>(2.0 * params_.max_range_m / 1500.0);
  for (const MbesBeam& beam : *beams) {
    if (beam.flags == 0) continue;
    near = beam.twtt_s;
    break;
  }
  for (MbesBeam& beam : *beams) {
    if (beam.flags == 0)
      beam.twtt_s = near;
    else
      near = beam.twtt_s;
  }
}

MbesModel::Ping MbesModel::PingAt(double t_s) {
  const std::vector<Sector> sectors = SectorsAt(t_s);
  Ping result;
  MbesPing& ping = result.ping;
  ping.sound_speed_mps = scene_.water.SpeedAt(sectors.front().T_map_sonar.translation().z());
  ping.beams.reserve(static_cast<std::size_t>(params_.beams));
  for (int i = 0; i < params_.beams; ++i) {
    const std::size_t s =
        static_cast<std::size_t>(i) * sectors.size() / static_cast<std::size_t>(params_.beams);
    const double angle = NominalAngle(i) - (params_.roll_stabilised ? sectors[s].roll_rad : 0.0);
    ping.beams.push_back(Listen(t_s, sectors[s], angle));
    ping.beams.back().twtt_s *= static_cast<float>(1.0 + beam_bias_[static_cast<std::size_t>(i)]);
  }
  AddMisdetections(&ping.beams);
  FillRejected(&ping.beams);

  for (const MbesBeam& beam : ping.beams)
    result.last_echo_s =
        std::max(result.last_echo_s, double{beam.tx_delay_s} + double{beam.twtt_s});
  // the sonar listens a little longer than the travel time of the last echo
  constexpr double kGuard = 1.1;
  result.next_ping_s = params_.ping_rate_hz > 0.0
                           ? 1.0 / params_.ping_rate_hz
                           : std::max(1.0 / params_.max_ping_rate_hz, kGuard * result.last_echo_s);
  return result;
}

std::optional<double> FixModel::TimeAfter(double t_s) const {
  if (params_.interval_s == 0.0) return std::nullopt;
  const Path& path = scene_.trajectory.path();
  double next_s = t_s + params_.interval_s;
  if (params_.gps && !path.IsAtSurface(next_s))
    next_s = std::max(next_s, path.duration_s() - path.plan().surface_s);
  next_s = std::round(next_s * 1e6) * 1e-6;  // resolution of the stamp
  return next_s <= path.duration_s() ? std::optional(next_s) : std::nullopt;
}

PositionFix FixModel::FixAt(double t_s) {
  const char* const source = params_.gps ? "gps" : "usbl";
  const VehicleGeometry& vehicle = scene_.vehicle;
  const Eigen::Vector3d p_map =
      scene_.trajectory.StateAt(t_s).T_map_vehicle * vehicle.FixPointOf(source);
  const double dt_s = t_s - std::exchange(last_s_, t_s);
  wander_north_.Step(dt_s, &wander_random_);
  wander_east_.Step(dt_s, &wander_random_);
  double north_m = p_map.x() + wander_north_.value() + params_.sigma_m * random_.Normal();
  double east_m = p_map.y() + wander_east_.value() + params_.sigma_m * random_.Normal();
  const double direction_rad = 2.0 * kPi * random_.Uniform();
  if (random_.Chance(params_.wrong_rate)) {
    north_m += params_.wrong_m * std::cos(direction_rad);
    east_m += params_.wrong_m * std::sin(direction_rad);
  }
  const GeographicLib::LocalCartesian map(
      Rad2Deg(vehicle.datum.latitude_rad), Rad2Deg(vehicle.datum.longitude_rad), 0.0);
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double height_m = 0.0;
  map.Reverse(east_m, north_m, 0.0, latitude_deg, longitude_deg, height_m);
  PositionFix fix;
  fix.latitude_rad = Deg2Rad(latitude_deg);
  fix.longitude_rad = Deg2Rad(longitude_deg);
  fix.covariance_north_east_m2 =
      (params_.sigma_m * params_.sigma_m + params_.wander_m * params_.wander_m) *
      Eigen::Matrix2d::Identity();
  fix.source = source;
  return fix;
}

}  // namespace seastitch::bench
