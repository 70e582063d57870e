#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"
#include "common/core/bytes.hpp"
#include "common/core/sound_speed.hpp"

namespace seastitch {
namespace {

using namespace convert;  // the checks

constexpr float kMaxSounding_m = 15'000.0f;  // limit of a sounding's coordinates

bool HasEveryBeam(const mbes_ping_t& msg) {
  if (msg.num_beams < 0 || msg.num_beams > kMaxBeams) return false;
  const auto n = static_cast<std::size_t>(msg.num_beams);
  return msg.twtt_s.size() == n && msg.rx_angle_rad.size() == n && msg.tx_tilt_rad.size() == n &&
         msg.tx_delay_s.size() == n && msg.depth_sigma_ratio.size() == n &&
         msg.backscatter_db.size() == n && msg.flags.size() == n && msg.tx_array.size() == n;
}

bool HasEverySounding(const mbes_soundings_t& msg) {
  const std::int32_t n = msg.num_soundings;
  return n >= 0 && n <= kMaxSoundings && IsFiniteArray(msg.x_m, n) && IsFiniteArray(msg.y_m, n) &&
         IsFiniteArray(msg.z_m, n) && IsFiniteArray(msg.sigma_z_m, n) &&
         msg.flags.size() == static_cast<std::size_t>(n);
}

bool IsPingNumber(std::int64_t number) { return number >= 0 && number <= UINT32_MAX; }

bool IsOnEarth(double latitude_rad, double longitude_rad) {
  return std::abs(latitude_rad) <= kPi / 2.0 && std::abs(longitude_rad) <= kPi;
}

bool IsStrictlyRising(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), [](double a, double b) {
           return !(a < b);
         }) == values.end();
}

// Indices of at most `most` of `count` elements, evenly spaced, first and last included.
std::vector<std::size_t> EvenlyChosen(std::size_t count, std::size_t most) {
  std::vector<std::size_t> chosen;
  const std::size_t n = std::min(count, most);
  for (std::size_t i = 0; i < n; ++i) chosen.push_back(n == count ? i : i * (count - 1) / (n - 1));
  return chosen;
}

std::int8_t HeadToLcm(std::uint8_t head) {
  return static_cast<std::int8_t>(std::min(head, kMaxHead));
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
  msg.alignment = static_cast<std::int8_t>(sample.alignment);
  return msg;
}

std::optional<ImuSample> FromLcm(const imu_t& msg) {
  if (!IsTime(msg.utime) || !AllFinite(msg.angular_rate_radps, 3) ||
      !AllFinite(msg.specific_force_mps2, 3) || msg.alignment < imu_t::ALIGNMENT_UNKNOWN ||
      msg.alignment > imu_t::ALIGNMENT_ALIGNED)
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
  sample.alignment = static_cast<HeadingAlignment>(msg.alignment);
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
    msg.beam_quality[i] = sample.beams[i].quality.value_or(0.0);
  }
  msg.has_beam_quality = HasQuality(sample);
  msg.has_altitude = sample.altitude_m.has_value();
  msg.altitude_m = sample.altitude_m.value_or(0.0);
  msg.has_error_velocity = sample.error_velocity_mps.has_value();
  msg.error_velocity_mps = sample.error_velocity_mps.value_or(0.0);
  return msg;
}

std::optional<DvlSample> FromLcm(const dvl_t& msg) {
  if (!IsTime(msg.utime) || !AllFinite(msg.v_dvl_mps, 3) || !AreSigmas(msg.sigma_v_mps, 3) ||
      !AreSigmas(msg.beam_range_m, 4) || !AllFinite(msg.beam_velocity_mps, 4) ||
      !AreSigmas(&msg.altitude_m, 1) || !AreSigmas(msg.beam_quality, 4) ||
      *std::max_element(msg.beam_quality, msg.beam_quality + 4) > 1.0 ||
      !std::isfinite(msg.error_velocity_mps))
    return std::nullopt;
  DvlSample sample;
  sample.time = FromUtime(msg.utime);
  sample.bottom_lock = msg.bottom_lock != 0;
  if (sample.bottom_lock) {
    sample.v_dvl_mps = VectorFrom(msg.v_dvl_mps);
    sample.sigma_v_mps = VectorFrom(msg.sigma_v_mps);
  }
  for (std::size_t i = 0; i < sample.beams.size(); ++i) {
    DvlBeam& beam = sample.beams[i];
    beam = {msg.beam_valid[i] != 0, msg.beam_range_m[i], msg.beam_velocity_mps[i], std::nullopt};
    if (msg.has_beam_quality) beam.quality = msg.beam_quality[i];
  }
  if (msg.has_altitude) sample.altitude_m = msg.altitude_m;
  if (msg.has_error_velocity) sample.error_velocity_mps = msg.error_velocity_mps;
  return sample;
}

depth_t ToLcm(const DepthSample& sample, const MessageStamp& stamp) {
  depth_t msg{};
  SetStamp(sample.time, stamp, &msg);
  msg.has_pressure = sample.pressure_pa.has_value();
  msg.pressure_pa = sample.pressure_pa.value_or(0.0);
  msg.depth_m = sample.depth_m;
  msg.sigma_m = sample.sigma_m;
  return msg;
}

std::optional<DepthSample> FromLcm(const depth_t& msg) {
  if (!IsTime(msg.utime) || !std::isfinite(msg.pressure_pa) || !std::isfinite(msg.depth_m) ||
      !AreSigmas(&msg.sigma_m, 1))
    return std::nullopt;
  DepthSample sample{FromUtime(msg.utime), std::nullopt, msg.depth_m, msg.sigma_m};
  if (msg.has_pressure) sample.pressure_pa = msg.pressure_pa;
  return sample;
}

mbes_ping_t ToLcm(const MbesPing& ping, const MessageStamp& stamp) {
  mbes_ping_t msg{};
  SetStamp(ping.time, stamp, &msg);
  msg.ping_number = ping.ping_number;
  msg.head = HeadToLcm(ping.head);
  msg.sound_speed_mps = ping.sound_speed_mps;
  for (const std::size_t i : EvenlyChosen(ping.beams.size(), kMaxBeams)) {
    const MbesBeam& beam = ping.beams[i];
    msg.twtt_s.push_back(beam.twtt_s);
    msg.rx_angle_rad.push_back(beam.rx_angle_rad);
    msg.tx_tilt_rad.push_back(beam.tx_tilt_rad);
    msg.tx_delay_s.push_back(beam.tx_delay_s);
    msg.depth_sigma_ratio.push_back(beam.depth_sigma_ratio);
    msg.backscatter_db.push_back(beam.backscatter_db);
    msg.flags.push_back(beam.flags);
    msg.tx_array.push_back(beam.tx_array);
  }
  msg.num_beams = static_cast<std::int32_t>(msg.flags.size());
  return msg;
}

std::optional<MbesPing> FromLcm(const mbes_ping_t& msg) {
  if (!IsTime(msg.utime) || !IsPingNumber(msg.ping_number) || msg.head < 0 ||
      !(msg.sound_speed_mps >= 0.0) || !std::isfinite(msg.sound_speed_mps) || !HasEveryBeam(msg))
    return std::nullopt;
  MbesPing ping;
  ping.time = FromUtime(msg.utime);
  ping.ping_number = static_cast<std::uint32_t>(msg.ping_number);
  ping.sound_speed_mps = msg.sound_speed_mps;
  ping.head = static_cast<std::uint8_t>(msg.head);
  ping.beams.resize(msg.twtt_s.size());
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    ping.beams[i] = {msg.twtt_s[i],
                     msg.rx_angle_rad[i],
                     msg.tx_tilt_rad[i],
                     msg.tx_delay_s[i],
                     msg.depth_sigma_ratio[i],
                     msg.backscatter_db[i],
                     msg.flags[i],
                     msg.tx_array[i]};
    if (!IsPlausible(ping.beams[i])) return std::nullopt;
  }
  return ping;
}

std::vector<mbes_soundings_t> ToLcm(const SoundingPing& ping, const MessageStamp& first) {
  constexpr auto kPart = static_cast<std::size_t>(kMaxSoundings);
  std::vector<mbes_soundings_t> messages;
  std::size_t begin = 0;
  do {  // a ping without soundings gives one message, too
    const std::size_t end = std::min(ping.soundings.size(), begin + kPart);
    mbes_soundings_t& msg = messages.emplace_back(mbes_soundings_t{});
    SetStamp(ping.time, first, &msg);
    msg.seq = first.seq + static_cast<std::int64_t>(begin / kPart);
    msg.ping_number = ping.ping_number;
    msg.head = HeadToLcm(ping.head);
    msg.num_soundings = static_cast<std::int32_t>(end - begin);
    for (; begin < end; ++begin) {
      const LevelSounding& sounding = ping.soundings[begin];
      msg.x_m.push_back(sounding.p_level_m.x());
      msg.y_m.push_back(sounding.p_level_m.y());
      msg.z_m.push_back(sounding.p_level_m.z());
      msg.sigma_z_m.push_back(sounding.sigma_z_m);
      msg.flags.push_back(sounding.flags);
    }
  } while (begin < ping.soundings.size());
  return messages;
}

std::optional<SoundingPing> FromLcm(const mbes_soundings_t& msg) {
  if (!IsTime(msg.utime) || !IsPingNumber(msg.ping_number) || msg.head < 0 ||
      !HasEverySounding(msg))
    return std::nullopt;
  SoundingPing ping;
  ping.time = FromUtime(msg.utime);
  ping.ping_number = static_cast<std::uint32_t>(msg.ping_number);
  ping.head = static_cast<std::uint8_t>(msg.head);
  for (std::size_t i = 0; i < msg.x_m.size(); ++i) {
    const Eigen::Vector3f p_level_m(msg.x_m[i], msg.y_m[i], msg.z_m[i]);
    if (!(p_level_m.cwiseAbs().maxCoeff() <= kMaxSounding_m) || msg.sigma_z_m[i] < 0.0f)
      return std::nullopt;
    ping.soundings.push_back({p_level_m, msg.sigma_z_m[i], msg.flags[i]});
  }
  return ping;
}

sound_velocity_profile_t ToLcm(const SoundVelocityProfile& profile, const MessageStamp& stamp) {
  sound_velocity_profile_t msg{};
  SetStamp(profile.time, stamp, &msg);
  const std::size_t samples = std::min(profile.depth_m.size(), profile.speed_mps.size());
  for (const std::size_t i : EvenlyChosen(samples, kMaxProfileSamples)) {
    msg.depth_m.push_back(profile.depth_m[i]);
    msg.speed_mps.push_back(profile.speed_mps[i]);
  }
  msg.num_samples = static_cast<std::int32_t>(msg.depth_m.size());
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
  msg.source = fix.source.substr(0, kMaxSourceLength);
  return msg;
}

std::optional<Heartbeat> FromLcm(const health_t& msg) {
  if (!IsTime(msg.utime) || !(msg.uptime_s >= 0.0 && std::isfinite(msg.uptime_s)) ||
      msg.process.empty() || msg.process.size() > kMaxProcessName)
    return std::nullopt;
  return Heartbeat{msg.process, FromUtime(msg.utime), msg.uptime_s};
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
  // Positive definite: a fix with a zero variance would fix the whole map exactly at its position.
  const bool honest = covariance.allFinite() && msg.variance_north_m2 > 0.0 &&
                      msg.variance_east_m2 > 0.0 && covariance.determinant() > 0.0;
  if (!IsTime(msg.utime) || !IsOnEarth(fix.latitude_rad, fix.longitude_rad) || !honest ||
      msg.source.size() > kMaxSourceLength)
    return std::nullopt;
  return fix;
}

navigation_t ToLcm(const NavigationSample& sample, const MessageStamp& stamp) {
  navigation_t msg{};
  SetStamp(sample.time, stamp, &msg);
  msg.source = sample.source.substr(0, kMaxSourceLength);
  msg.status = static_cast<std::int8_t>(sample.status);
  if (const auto& position = sample.position) {
    msg.has_position = true;
    msg.latitude_rad = position->latitude_rad;
    msg.longitude_rad = position->longitude_rad;
    msg.sigma_north_m = position->sigma_north_east_m.x();
    msg.sigma_east_m = position->sigma_north_east_m.y();
  }
  if (sample.depth) {
    msg.has_depth = true;
    msg.depth_m = sample.depth->value_m;
    msg.sigma_depth_m = sample.depth->sigma_m;
  }
  if (sample.height) {
    msg.has_height = true;
    msg.height_m = sample.height->value_m;
    msg.sigma_height_m = sample.height->sigma_m;
  }
  if (sample.attitude) {
    msg.has_attitude = true;
    QuaternionTo(sample.attitude->q_ned_imu, msg.q_ned_ins);
    Eigen::Map<Eigen::Vector3d>(msg.sigma_roll_pitch_yaw_rad, 3) = sample.attitude->sigma_rpy_rad;
  }
  if (sample.velocity) {
    msg.has_velocity = true;
    Eigen::Map<Eigen::Vector3d>(msg.v_ned_mps, 3) = sample.velocity->v_ned_mps;
    Eigen::Map<Eigen::Vector3d>(msg.sigma_v_ned_mps, 3) = sample.velocity->sigma_ned_mps;
  }
  return msg;
}

std::optional<NavigationSample> FromLcm(const navigation_t& msg) {
  const double sigmas[] = {
      msg.sigma_north_m, msg.sigma_east_m, msg.sigma_depth_m, msg.sigma_height_m};
  if (!IsTime(msg.utime) || msg.source.size() > kMaxSourceLength ||
      msg.status < navigation_t::STATUS_UNKNOWN || msg.status > navigation_t::STATUS_INVALID ||
      !AreSigmas(sigmas, std::size(sigmas)) || !IsOnEarth(msg.latitude_rad, msg.longitude_rad) ||
      !(std::abs(msg.depth_m) <= kMaxCoordinate_m) ||
      !(std::abs(msg.height_m) <= kMaxCoordinate_m) || !AllFinite(msg.v_ned_mps, 3) ||
      !AreSigmas(msg.sigma_v_ned_mps, 3) || !AreSigmas(msg.sigma_roll_pitch_yaw_rad, 3))
    return std::nullopt;
  NavigationSample sample;
  sample.time = FromUtime(msg.utime);
  sample.status = static_cast<InsStatus>(msg.status);
  sample.source = msg.source;
  if (msg.has_position) {
    sample.position =
        InsPosition{msg.latitude_rad, msg.longitude_rad, {msg.sigma_north_m, msg.sigma_east_m}};
  }
  if (msg.has_depth) sample.depth = InsVertical{msg.depth_m, msg.sigma_depth_m};
  if (msg.has_height) sample.height = InsVertical{msg.height_m, msg.sigma_height_m};
  if (msg.has_attitude) {
    const std::optional<Eigen::Quaterniond> q = QuaternionFrom(msg.q_ned_ins);
    if (!q) return std::nullopt;
    sample.attitude = Attitude{*q, VectorFrom(msg.sigma_roll_pitch_yaw_rad)};
  }
  if (msg.has_velocity)
    sample.velocity = InsVelocity{VectorFrom(msg.v_ned_mps), VectorFrom(msg.sigma_v_ned_mps)};
  return sample;
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

nav_corrected_t ToLcm(const CorrectedNavState& corrected, std::int64_t seq) {
  nav_corrected_t msg{};
  const NavState& nav = corrected.state;
  msg.utime = ToUtime(nav.time);
  msg.seq = seq;
  PoseTo(nav.T_map_vehicle, msg.p_map_vehicle_m, msg.q_map_vehicle);
  Eigen::Map<Eigen::Vector3d>(msg.v_map_mps, 3) = nav.v_map_mps;
  MatrixTo<6>(nav.covariance, msg.covariance_ned_rpy);
  msg.correction_x_m = corrected.T_map_nav.x;
  msg.correction_y_m = corrected.T_map_nav.y;
  msg.correction_yaw_rad = corrected.T_map_nav.yaw;
  msg.graph_version = corrected.graph_version;
  msg.jumps = corrected.jumps;
  msg.last_jump_m = corrected.last_jump_m;
  msg.last_jump_yaw_rad = corrected.last_jump_yaw_rad;
  return msg;
}

std::optional<CorrectedNavState> FromLcm(const nav_corrected_t& msg) {
  const std::optional<Eigen::Isometry3d> pose = PoseFrom(msg.p_map_vehicle_m, msg.q_map_vehicle);
  const std::optional<Matrix6d> covariance = SymmetricFrom<6>(msg.covariance_ned_rpy);
  const Pose2 correction{msg.correction_x_m, msg.correction_y_m, msg.correction_yaw_rad};
  if (!IsTime(msg.utime) || !pose || !covariance || !AllFinite(msg.v_map_mps, 3) ||
      !IsPose2(correction) || msg.graph_version < 0 || msg.jumps < 0 ||
      !AreSigmas(&msg.last_jump_m, 1) || !std::isfinite(msg.last_jump_yaw_rad))
    return std::nullopt;
  CorrectedNavState corrected;
  corrected.state.time = FromUtime(msg.utime);
  corrected.state.T_map_vehicle = *pose;
  corrected.state.v_map_mps = VectorFrom(msg.v_map_mps);
  corrected.state.covariance = *covariance;
  corrected.T_map_nav = correction;
  corrected.graph_version = msg.graph_version;
  corrected.jumps = msg.jumps;
  corrected.last_jump_m = msg.last_jump_m;
  corrected.last_jump_yaw_rad = msg.last_jump_yaw_rad;
  return corrected;
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
