#include <algorithm>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"
#include "common/core/bytes.hpp"

namespace seastitch {
namespace {

using namespace convert;  // the checks

constexpr std::size_t kMaxSourceLength = 256;
constexpr double kMinSoundSpeed_mps = 1000.0;
constexpr double kMaxSoundSpeed_mps = 2000.0;

bool IsSoundSpeed(double mps) { return mps >= kMinSoundSpeed_mps && mps <= kMaxSoundSpeed_mps; }

bool HasEveryBeam(const mbes_ping_t& msg) {
  if (msg.num_beams < 0 || msg.num_beams > kMaxBeams) return false;
  const auto n = static_cast<std::size_t>(msg.num_beams);
  return msg.twtt_s.size() == n && msg.rx_angle_rad.size() == n && msg.tx_tilt_rad.size() == n &&
         msg.tx_delay_s.size() == n && msg.depth_sigma_ratio.size() == n &&
         msg.backscatter_db.size() == n && msg.flags.size() == n;
}

bool IsStrictlyRising(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), [](double a, double b) {
           return !(a < b);
         }) == values.end();
}

template <class Msg>
void SetStamp(Time time, const MessageStamp& stamp, Msg* msg) {
  msg->utime = ToUtime(time);
  msg->recv_utime = ToUtime(stamp.recv);
  msg->seq = stamp.seq;
}

Eigen::Vector3d VectorFrom(const double (&v)[3]) { return Eigen::Vector3d(v[0], v[1], v[2]); }

}  // namespace

imu_t ToLcm(const ImuSample& sample, const MessageStamp& stamp) {
  imu_t msg{};
  SetStamp(sample.time, stamp, &msg);
  Eigen::Map<Eigen::Vector3d>(msg.angular_rate_radps, 3) = sample.angular_rate_radps;
  Eigen::Map<Eigen::Vector3d>(msg.specific_force_mps2, 3) = sample.specific_force_mps2;
  msg.has_attitude = sample.attitude.has_value();
  if (sample.attitude) {
    QuaternionTo(sample.attitude->q_ned_imu, msg.q_ned_imu);
    Eigen::Map<Eigen::Vector3d>(msg.sigma_roll_pitch_yaw_rad, 3) = sample.attitude->sigma_rpy_rad;
  }
  return msg;
}

std::optional<ImuSample> FromLcm(const imu_t& msg) {
  if (!IsTime(msg.utime) || !AllFinite(msg.angular_rate_radps, 3) ||
      !AllFinite(msg.specific_force_mps2, 3))
    return std::nullopt;
  ImuSample sample;
  sample.time = FromUtime(msg.utime);
  sample.angular_rate_radps = VectorFrom(msg.angular_rate_radps);
  sample.specific_force_mps2 = VectorFrom(msg.specific_force_mps2);
  if (msg.has_attitude) {
    const std::optional<Eigen::Quaterniond> q = QuaternionFrom(msg.q_ned_imu);
    if (!q || !AreSigmas(msg.sigma_roll_pitch_yaw_rad, 3)) return std::nullopt;
    sample.attitude = Attitude{*q, VectorFrom(msg.sigma_roll_pitch_yaw_rad)};
  }
  return sample;
}

dvl_t ToLcm(const DvlSample& sample, const MessageStamp& stamp) {
  dvl_t msg{};
  SetStamp(sample.time, stamp, &msg);
  msg.bottom_lock = sample.bottom_lock;
  if (sample.bottom_lock) {
    Eigen::Map<Eigen::Vector3d>(msg.v_dvl_mps, 3) = sample.v_dvl_mps;
    Eigen::Map<Eigen::Vector3d>(msg.sigma_v_mps, 3) = sample.sigma_v_mps;
  }
  for (std::size_t i = 0; i < sample.beams.size(); ++i) {
    msg.beam_valid[i] = sample.beams[i].valid;
    msg.beam_range_m[i] = sample.beams[i].range_m;
    msg.beam_velocity_mps[i] = sample.beams[i].velocity_mps;
  }
  msg.has_altitude = sample.altitude_m.has_value();
  msg.altitude_m = sample.altitude_m.value_or(0.0);
  return msg;
}

std::optional<DvlSample> FromLcm(const dvl_t& msg) {
  if (!IsTime(msg.utime) || !AllFinite(msg.v_dvl_mps, 3) || !AreSigmas(msg.sigma_v_mps, 3) ||
      !AreSigmas(msg.beam_range_m, 4) || !AllFinite(msg.beam_velocity_mps, 4) ||
      !AreSigmas(&msg.altitude_m, 1))
    return std::nullopt;
  DvlSample sample;
  sample.time = FromUtime(msg.utime);
  sample.bottom_lock = msg.bottom_lock != 0;
  if (sample.bottom_lock) {
    sample.v_dvl_mps = VectorFrom(msg.v_dvl_mps);
    sample.sigma_v_mps = VectorFrom(msg.sigma_v_mps);
  }
  for (std::size_t i = 0; i < sample.beams.size(); ++i)
    sample.beams[i] = {msg.beam_valid[i] != 0, msg.beam_range_m[i], msg.beam_velocity_mps[i]};
  if (msg.has_altitude) sample.altitude_m = msg.altitude_m;
  return sample;
}

depth_t ToLcm(const DepthSample& sample, const MessageStamp& stamp) {
  depth_t msg{};
  SetStamp(sample.time, stamp, &msg);
  msg.pressure_pa = sample.pressure_pa;
  msg.depth_m = sample.depth_m;
  msg.sigma_m = sample.sigma_m;
  return msg;
}

std::optional<DepthSample> FromLcm(const depth_t& msg) {
  if (!IsTime(msg.utime) || !std::isfinite(msg.pressure_pa) || !std::isfinite(msg.depth_m) ||
      !AreSigmas(&msg.sigma_m, 1))
    return std::nullopt;
  return DepthSample{FromUtime(msg.utime), msg.pressure_pa, msg.depth_m, msg.sigma_m};
}

mbes_ping_t ToLcm(const MbesPing& ping, const MessageStamp& stamp) {
  mbes_ping_t msg{};
  SetStamp(ping.time, stamp, &msg);
  msg.ping_number = ping.ping_number;
  msg.sound_speed_mps = ping.sound_speed_mps;
  msg.num_beams = static_cast<std::int32_t>(ping.beams.size());
  for (const MbesBeam& beam : ping.beams) {
    msg.twtt_s.push_back(beam.twtt_s);
    msg.rx_angle_rad.push_back(beam.rx_angle_rad);
    msg.tx_tilt_rad.push_back(beam.tx_tilt_rad);
    msg.tx_delay_s.push_back(beam.tx_delay_s);
    msg.depth_sigma_ratio.push_back(beam.depth_sigma_ratio);
    msg.backscatter_db.push_back(beam.backscatter_db);
    msg.flags.push_back(beam.flags);
  }
  return msg;
}

std::optional<MbesPing> FromLcm(const mbes_ping_t& msg) {
  if (!IsTime(msg.utime) || msg.ping_number < 0 || msg.ping_number > UINT32_MAX ||
      !(msg.sound_speed_mps >= 0.0) || !std::isfinite(msg.sound_speed_mps) || !HasEveryBeam(msg))
    return std::nullopt;
  MbesPing ping;
  ping.time = FromUtime(msg.utime);
  ping.ping_number = static_cast<std::uint32_t>(msg.ping_number);
  ping.sound_speed_mps = msg.sound_speed_mps;
  ping.beams.resize(msg.twtt_s.size());
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    ping.beams[i] = {msg.twtt_s[i],
                     msg.rx_angle_rad[i],
                     msg.tx_tilt_rad[i],
                     msg.tx_delay_s[i],
                     msg.depth_sigma_ratio[i],
                     msg.backscatter_db[i],
                     msg.flags[i]};
    if (!IsPlausible(ping.beams[i])) return std::nullopt;
  }
  return ping;
}

sound_velocity_profile_t ToLcm(const SoundVelocityProfile& profile, const MessageStamp& stamp) {
  sound_velocity_profile_t msg{};
  SetStamp(profile.time, stamp, &msg);
  msg.num_samples = static_cast<std::int32_t>(profile.depth_m.size());
  msg.depth_m = profile.depth_m;
  msg.speed_mps = profile.speed_mps;
  return msg;
}

std::optional<SoundVelocityProfile> FromLcm(const sound_velocity_profile_t& msg) {
  if (!IsTime(msg.utime) || msg.num_samples < 1 || msg.num_samples > kMaxProfileSamples ||
      !IsFiniteArray(msg.depth_m, msg.num_samples) ||
      !IsFiniteArray(msg.speed_mps, msg.num_samples) || !IsStrictlyRising(msg.depth_m) ||
      !std::all_of(msg.speed_mps.begin(), msg.speed_mps.end(), IsSoundSpeed))
    return std::nullopt;
  return SoundVelocityProfile{FromUtime(msg.utime), msg.depth_m, msg.speed_mps};
}

position_fix_t ToLcm(const PositionFix& fix, const MessageStamp& stamp) {
  position_fix_t msg{};
  SetStamp(fix.time, stamp, &msg);
  msg.latitude_rad = fix.latitude_rad;
  msg.longitude_rad = fix.longitude_rad;
  msg.variance_north_m2 = fix.covariance_north_east_m2(0, 0);
  msg.variance_east_m2 = fix.covariance_north_east_m2(1, 1);
  msg.covariance_north_east_m2 = fix.covariance_north_east_m2(0, 1);
  msg.source = fix.source;
  return msg;
}

std::optional<PositionFix> FromLcm(const position_fix_t& msg) {
  PositionFix fix;
  fix.time = FromUtime(msg.utime);
  fix.latitude_rad = msg.latitude_rad;
  fix.longitude_rad = msg.longitude_rad;
  Eigen::Matrix2d& covariance = fix.covariance_north_east_m2;
  covariance << msg.variance_north_m2, msg.covariance_north_east_m2, msg.covariance_north_east_m2,
      msg.variance_east_m2;
  fix.source = msg.source;
  const bool on_earth =
      std::abs(fix.latitude_rad) <= kPi / 2.0 && std::abs(fix.longitude_rad) <= kPi;
  // Positive definite: a fix without scatter would nail the whole map to it.
  const bool honest = covariance.allFinite() && msg.variance_north_m2 > 0.0 &&
                      msg.variance_east_m2 > 0.0 && covariance.determinant() > 0.0;
  if (!IsTime(msg.utime) || !on_earth || !honest || msg.source.size() > kMaxSourceLength)
    return std::nullopt;
  return fix;
}

nav_t ToLcm(const NavState& nav, std::int64_t seq) {
  nav_t msg{};
  msg.utime = ToUtime(nav.time);
  msg.seq = seq;
  PoseTo(nav.T_map_vehicle, msg.p_map_vehicle_m, msg.q_map_vehicle);
  Eigen::Map<Eigen::Vector3d>(msg.v_map_mps, 3) = nav.v_map_mps;
  MatrixTo<6>(nav.covariance, msg.covariance_ned_rpy);
  msg.bottom_lock = nav.bottom_lock;
  return msg;
}

std::optional<NavState> FromLcm(const nav_t& msg) {
  const std::optional<Eigen::Isometry3d> pose = PoseFrom(msg.p_map_vehicle_m, msg.q_map_vehicle);
  const std::optional<Matrix6d> covariance = SymmetricFrom<6>(msg.covariance_ned_rpy);
  if (!IsTime(msg.utime) || !pose || !covariance || !AllFinite(msg.v_map_mps, 3))
    return std::nullopt;
  NavState nav;
  nav.time = FromUtime(msg.utime);
  nav.T_map_vehicle = *pose;
  nav.v_map_mps = VectorFrom(msg.v_map_mps);
  nav.covariance = *covariance;
  nav.bottom_lock = msg.bottom_lock != 0;
  return nav;
}

std::vector<raw_bytes_t> ToRawParts(const std::vector<std::uint8_t>& bytes,
                                    const std::string& source,
                                    Time recv,
                                    std::int64_t first_seq) {
  constexpr auto kPart = static_cast<std::size_t>(kMaxRawBytesPerPart);
  const std::size_t num_parts = std::max<std::size_t>(1, (bytes.size() + kPart - 1) / kPart);
  std::vector<raw_bytes_t> parts;
  for (std::size_t part = 0; part < num_parts; ++part) {
    const Bytes rest = Bytes(bytes).subspan(part * kPart);
    const Bytes payload = rest.first(std::min(rest.size(), kPart));
    raw_bytes_t msg{};
    msg.recv_utime = ToUtime(recv);
    msg.seq = first_seq + static_cast<std::int64_t>(part);
    msg.source = source.substr(0, kMaxSourceLength);
    msg.part = static_cast<std::int32_t>(part);
    msg.num_parts = static_cast<std::int32_t>(num_parts);
    msg.size = static_cast<std::int32_t>(payload.size());
    msg.data.assign(payload.begin(), payload.end());
    parts.push_back(std::move(msg));
  }
  return parts;
}

}  // namespace seastitch
