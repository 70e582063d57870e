#include <algorithm>
#include <cmath>
#include <utility>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"
#include "common/core/bytes.hpp"

namespace seastitch {
namespace {

using namespace convert;  // the checks

bool HasEveryBeam(const mbes_ping_t& msg) {
  if (msg.num_beams < 0 || msg.num_beams > kMaxBeams) return false;
  const auto n = static_cast<std::size_t>(msg.num_beams);
  return msg.twtt_s.size() == n && msg.rx_angle_rad.size() == n && msg.tx_tilt_rad.size() == n &&
         msg.tx_delay_s.size() == n && msg.depth_sigma_ratio.size() == n &&
         msg.backscatter_db.size() == n && msg.flags.size() == n && msg.tx_array.size() == n;
}

bool HasEverySounding(const mbes_soundings_t& msg) {
  if (msg.num_soundings < 0 || msg.num_soundings > kMaxSoundings) return false;
  const auto n = static_cast<std::size_t>(msg.num_soundings);
  return msg.x_m.size() == n && msg.y_m.size() == n && msg.z_m.size() == n &&
         msg.sigma_z_m.size() == n && msg.flags.size() == n;
}

bool IsPingNumber(std::int64_t number) { return number >= 0 && number <= UINT32_MAX; }

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
  ImuSample sample;
  sample.time = FromUtime(msg.utime);
  sample.angular_rate_radps = VectorFrom(msg.angular_rate_radps);
  sample.specific_force_mps2 = VectorFrom(msg.specific_force_mps2);
  if (msg.has_attitude)
    sample.attitude =
        Attitude{QuaternionFrom(msg.q_ned_imu), VectorFrom(msg.sigma_roll_pitch_yaw_rad)};
  sample.alignment = static_cast<HeadingAlignment>(msg.alignment);
  return Checked(sample);
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

// Fields without a meaning are checked, too: a message with one that is not finite is damaged.
std::optional<DvlSample> FromLcm(const dvl_t& msg) {
  DvlSample sample;
  sample.time = FromUtime(msg.utime);
  sample.bottom_lock = msg.bottom_lock != 0;
  sample.v_dvl_mps = VectorFrom(msg.v_dvl_mps);
  sample.sigma_v_mps = VectorFrom(msg.sigma_v_mps);
  for (std::size_t i = 0; i < sample.beams.size(); ++i)
    sample.beams[i] = {
        msg.beam_valid[i] != 0, msg.beam_range_m[i], msg.beam_velocity_mps[i], msg.beam_quality[i]};
  sample.altitude_m = msg.altitude_m;
  sample.error_velocity_mps = msg.error_velocity_mps;
  std::optional<DvlSample> checked = Checked(sample);
  if (!checked) return std::nullopt;
  if (!msg.has_beam_quality)
    for (DvlBeam& beam : checked->beams) beam.quality.reset();
  if (!msg.has_altitude) checked->altitude_m.reset();
  if (!msg.has_error_velocity) checked->error_velocity_mps.reset();
  return checked;
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
  std::optional<DepthSample> checked =
      Checked(DepthSample{FromUtime(msg.utime), msg.pressure_pa, msg.depth_m, msg.sigma_m});
  if (checked && !msg.has_pressure) checked->pressure_pa.reset();
  return checked;
}

mbes_ping_t ToLcm(const MbesPing& ping, const MessageStamp& stamp) {
  if (ping.beams.size() > kMaxBeams) return ToLcm(Thinned(ping), stamp);
  mbes_ping_t msg{};
  SetStamp(ping.time, stamp, &msg);
  msg.ping_number = ping.ping_number;
  msg.head = HeadToLcm(ping.head);
  msg.sound_speed_mps = ping.sound_speed_mps;
  for (const MbesBeam& beam : ping.beams) {
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
  if (!IsPingNumber(msg.ping_number) || msg.head < 0 || !HasEveryBeam(msg)) return std::nullopt;
  MbesPing ping;
  ping.time = FromUtime(msg.utime);
  ping.ping_number = static_cast<std::uint32_t>(msg.ping_number);
  ping.sound_speed_mps = msg.sound_speed_mps;
  ping.head = static_cast<std::uint8_t>(msg.head);
  ping.beams.resize(msg.twtt_s.size());
  for (std::size_t i = 0; i < ping.beams.size(); ++i)
    ping.beams[i] = {msg.twtt_s[i],
                     msg.rx_angle_rad[i],
                     msg.tx_tilt_rad[i],
                     msg.tx_delay_s[i],
                     msg.depth_sigma_ratio[i],
                     msg.backscatter_db[i],
                     msg.flags[i],
                     msg.tx_array[i]};
  return Checked(std::move(ping));
}

std::vector<mbes_soundings_t> ToLcm(const SoundingPing& ping, const MessageStamp& first) {
  std::vector<mbes_soundings_t> messages;
  for (const SoundingPing& part : Split(ping)) {
    mbes_soundings_t& msg = messages.emplace_back(mbes_soundings_t{});
    SetStamp(part.time, first, &msg);
    msg.seq = first.seq + static_cast<std::int64_t>(messages.size()) - 1;
    msg.ping_number = part.ping_number;
    msg.head = HeadToLcm(part.head);
    msg.num_soundings = static_cast<std::int32_t>(part.soundings.size());
    for (const LevelSounding& sounding : part.soundings) {
      msg.x_m.push_back(sounding.p_level_m.x());
      msg.y_m.push_back(sounding.p_level_m.y());
      msg.z_m.push_back(sounding.p_level_m.z());
      msg.sigma_z_m.push_back(sounding.sigma_z_m);
      msg.flags.push_back(sounding.flags);
    }
  }
  return messages;
}

std::optional<SoundingPing> FromLcm(const mbes_soundings_t& msg) {
  if (!IsPingNumber(msg.ping_number) || msg.head < 0 || !HasEverySounding(msg)) return std::nullopt;
  SoundingPing ping;
  ping.time = FromUtime(msg.utime);
  ping.ping_number = static_cast<std::uint32_t>(msg.ping_number);
  ping.head = static_cast<std::uint8_t>(msg.head);
  for (std::size_t i = 0; i < msg.x_m.size(); ++i)
    ping.soundings.push_back(
        {{msg.x_m[i], msg.y_m[i], msg.z_m[i]}, msg.sigma_z_m[i], msg.flags[i]});
  return Checked(std::move(ping));
}

sound_velocity_profile_t ToLcm(const SoundVelocityProfile& profile, const MessageStamp& stamp) {
  sound_velocity_profile_t msg{};
  SetStamp(profile.time, stamp, &msg);
  const SoundVelocityProfile thinned = Thinned(profile);
  msg.depth_m = thinned.depth_m;
  msg.speed_mps = thinned.speed_mps;
  msg.num_samples = static_cast<std::int32_t>(msg.depth_m.size());
  return msg;
}

std::optional<SoundVelocityProfile> FromLcm(const sound_velocity_profile_t& msg) {
  const auto n = static_cast<std::size_t>(std::max(0, msg.num_samples));
  if (n > kMaxProfileSamples || msg.depth_m.size() != n || msg.speed_mps.size() != n)
    return std::nullopt;
  return Checked(SoundVelocityProfile{FromUtime(msg.utime), msg.depth_m, msg.speed_mps});
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
  if (!IsTime(FromUtime(msg.utime)) || !IsSigma(msg.uptime_s) || msg.process.empty() ||
      msg.process.size() > kMaxProcessName)
    return std::nullopt;
  return Heartbeat{msg.process, FromUtime(msg.utime), msg.uptime_s};
}

std::optional<PositionFix> FromLcm(const position_fix_t& msg) {
  if (msg.source.size() > kMaxSourceLength) return std::nullopt;
  PositionFix fix;
  fix.time = FromUtime(msg.utime);
  fix.latitude_rad = msg.latitude_rad;
  fix.longitude_rad = msg.longitude_rad;
  fix.covariance_north_east_m2 << msg.variance_north_m2, msg.covariance_north_east_m2,
      msg.covariance_north_east_m2, msg.variance_east_m2;
  fix.source = msg.source;
  return Checked(std::move(fix));
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

// Fields without a meaning are checked, too: a message with one that is not finite is damaged.
std::optional<NavigationSample> FromLcm(const navigation_t& msg) {
  if (msg.source.size() > kMaxSourceLength) return std::nullopt;
  NavigationSample sample;
  sample.time = FromUtime(msg.utime);
  sample.status = static_cast<InsStatus>(msg.status);
  sample.source = msg.source;
  sample.position =
      GeoPosition{msg.latitude_rad, msg.longitude_rad, {msg.sigma_north_m, msg.sigma_east_m}};
  sample.depth = InsVertical{msg.depth_m, msg.sigma_depth_m};
  sample.height = InsVertical{msg.height_m, msg.sigma_height_m};
  const Eigen::Vector3d sigma_rpy_rad = VectorFrom(msg.sigma_roll_pitch_yaw_rad);
  if (msg.has_attitude) sample.attitude = Attitude{QuaternionFrom(msg.q_ned_ins), sigma_rpy_rad};
  sample.velocity = GeoVelocity{VectorFrom(msg.v_ned_mps), VectorFrom(msg.sigma_v_ned_mps)};
  std::optional<NavigationSample> checked = Checked(std::move(sample));
  if (!checked || !AreSigmas(sigma_rpy_rad)) return std::nullopt;
  if (!msg.has_position) checked->position.reset();
  if (!msg.has_depth) checked->depth.reset();
  if (!msg.has_height) checked->height.reset();
  if (!msg.has_velocity) checked->velocity.reset();
  return checked;
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
  if (!pose) return std::nullopt;
  return Checked(NavState{FromUtime(msg.utime),
                          *pose,
                          VectorFrom(msg.v_map_mps),
                          MatrixFrom<6>(msg.covariance_ned_rpy),
                          msg.bottom_lock != 0});
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
  if (!pose) return std::nullopt;
  CorrectedNavState corrected;
  corrected.state.time = FromUtime(msg.utime);
  corrected.state.T_map_vehicle = *pose;
  corrected.state.v_map_mps = VectorFrom(msg.v_map_mps);
  corrected.state.covariance = MatrixFrom<6>(msg.covariance_ned_rpy);
  corrected.T_map_nav = {msg.correction_x_m, msg.correction_y_m, msg.correction_yaw_rad};
  corrected.graph_version = msg.graph_version;
  corrected.jumps = msg.jumps;
  corrected.last_jump_m = msg.last_jump_m;
  corrected.last_jump_yaw_rad = msg.last_jump_yaw_rad;
  return Checked(std::move(corrected));
}

std::vector<raw_bytes_t> ToRawParts(Bytes bytes,
                                    const std::string& source,
                                    Time recv,
                                    std::int64_t first_seq) {
  constexpr auto kPart = static_cast<std::size_t>(kMaxRawBytesPerPart);
  const std::size_t num_parts = std::max<std::size_t>(1, (bytes.size() + kPart - 1) / kPart);
  std::vector<raw_bytes_t> parts;
  for (std::size_t part = 0; part < num_parts; ++part) {
    const Bytes rest = bytes.subspan(part * kPart);
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
