#include "codecs/makers/s7k_sensors.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

NavigationRecord SampleOf(const S7kRecord& record) {
  NavigationRecord sample;
  sample.time = record.time;
  sample.source = std::to_string(record.type);
  return sample;
}

// A position; nothing if the latitude or longitude is impossible.
std::optional<GeoPosition> Position(double latitude_rad, double longitude_rad, double sigma_m) {
  if (!(std::abs(latitude_rad) <= kPi / 2.0) || !(std::abs(longitude_rad) <= 2.0 * kPi))
    return std::nullopt;
  const double sigma = std::isfinite(sigma_m) && sigma_m > 0.0 ? sigma_m : 0.0;
  return GeoPosition{latitude_rad, WrapAngle(longitude_rad), {sigma, sigma}};
}

Eigen::Vector3d ReadPlace(ByteReader* in) {
  const double starboard = in->Le<float>();
  const double forward = in->Le<float>();
  const double up = in->Le<float>();
  return {forward, starboard, -up};
}

Eigen::Isometry3d ReadMounting(ByteReader* in) {
  const Eigen::Vector3d place_m = ReadPlace(in);
  const double roll_rad = in->Le<float>();
  const double pitch_rad = in->Le<float>();
  const double heading_rad = in->Le<float>();
  return MakePose(place_m, RotationFromRpy(roll_rad, pitch_rad, heading_rad));
}

std::string ReadText(ByteReader* in) {
  const std::size_t length = in->Le<std::uint16_t>();
  const Bytes text = in->Take(128);
  return TextFromBytes(text.first(std::min(length, text.size())));
}

}  // namespace

std::optional<NavigationRecord> DecodeS7k1003(const S7kRecord& record) {
  ByteReader in(record.data);
  in.Skip(4);  // datum
  const float latency_s = in.Le<float>();
  const double north = in.Le<double>();  // latitude [rad], or metres of a grid
  const double east = in.Le<double>();
  const double height_m = in.Le<double>();
  const bool geographic = in.Le<std::uint8_t>() == 0;
  in.Skip(2);
  NavigationRecord sample = SampleOf(record);
  sample.status = in.Le<std::uint8_t>();  // positioning method
  constexpr double kLargestGridM = 1e8;
  if (geographic)
    sample.position = Position(north, east, 0.0);
  else if (std::abs(north) < kLargestGridM && std::abs(east) < kLargestGridM)
    sample.grid_north_east_m = Eigen::Vector2d(north, east);
  if (!in.ok() || !(sample.position || sample.grid_north_east_m) || !(std::abs(latency_s) < 60.0f))
    return std::nullopt;
  sample.time -= FromSeconds(latency_s);
  if (std::isfinite(height_m)) sample.height_m = height_m;
  return sample;
}

std::optional<NavigationRecord> DecodeS7k1012(const S7kRecord& record) {
  ByteReader in(record.data);
  const double roll_rad = in.Le<float>();
  const double pitch_rad = in.Le<float>();
  const double heave_up_m = in.Le<float>();
  if (!in.ok() || !std::isfinite(roll_rad) || !std::isfinite(pitch_rad) ||
      !std::isfinite(heave_up_m))
    return std::nullopt;
  NavigationRecord sample = SampleOf(record);
  sample.roll_pitch_rad = Eigen::Vector2d(roll_rad, pitch_rad);
  sample.heave_m = -heave_up_m;
  return sample;
}

std::optional<NavigationRecord> DecodeS7k1013(const S7kRecord& record) {
  ByteReader in(record.data);
  const double heading_rad = in.Le<float>();
  if (!in.ok() || !std::isfinite(heading_rad)) return std::nullopt;
  NavigationRecord sample = SampleOf(record);
  sample.heading_rad = heading_rad;
  return sample;
}

std::optional<NavigationRecord> DecodeS7k1015(const S7kRecord& record) {
  constexpr std::uint8_t kEllipsoid = 1;
  ByteReader in(record.data);
  const auto vertical_reference = in.Le<std::uint8_t>();
  const double latitude_rad = in.Le<double>();
  const double longitude_rad = in.Le<double>();
  const float accuracy_m = in.Le<float>();
  const double height_m = in.Le<float>();
  in.Skip(4);  // its accuracy
  const double speed_mps = in.Le<float>();
  const double course_rad = in.Le<float>();
  const double heading_rad = in.Le<float>();
  NavigationRecord sample = SampleOf(record);
  sample.position = Position(latitude_rad, longitude_rad, accuracy_m);
  if (!in.ok() || !sample.position || !std::isfinite(heading_rad)) return std::nullopt;
  sample.heading_rad = heading_rad;
  // Speed and course both zero: not filled in by the sender.
  const bool moves = speed_mps > 0.0 || (speed_mps == 0.0 && course_rad != 0.0);
  if (moves && std::isfinite(speed_mps) && std::isfinite(course_rad))
    sample.velocity =
        GeoVelocity{{speed_mps * std::cos(course_rad), speed_mps * std::sin(course_rad), 0.0}};
  if (vertical_reference == kEllipsoid && std::isfinite(height_m)) sample.height_m = height_m;
  return sample;
}

std::optional<std::vector<NavigationRecord>> DecodeS7k1016(const S7kRecord& record) {
  ByteReader in(record.data);
  const int count = in.Le<std::uint8_t>();
  std::vector<NavigationRecord> samples;
  for (int i = 0; i < count; ++i) {
    NavigationRecord sample = SampleOf(record);
    sample.time += std::chrono::milliseconds(in.Le<std::uint16_t>());
    const double roll_rad = in.Le<float>();
    const double pitch_rad = in.Le<float>();
    const double heave_up_m = in.Le<float>();
    const double heading_rad = in.Le<float>();
    if (!in.ok()) return std::nullopt;
    if (!std::isfinite(roll_rad) || !std::isfinite(pitch_rad) || !std::isfinite(heave_up_m) ||
        !std::isfinite(heading_rad))
      return std::nullopt;
    sample.attitude = AttitudeFromRadians(roll_rad, pitch_rad, heading_rad);
    sample.heave_m = -heave_up_m;
    samples.push_back(std::move(sample));
  }
  if (!in.ok()) return std::nullopt;
  return samples;
}

std::optional<SoundVelocityProfile> DecodeS7k1009(const S7kRecord& record) {
  ByteReader in(record.data);
  in.Skip(20);
  const std::size_t count = in.Le<std::uint32_t>();
  if (!in.ok() || in.left() / 8 < count) return std::nullopt;
  std::vector<ProfileRow> rows(count);
  for (ProfileRow& row : rows) {
    row.depth_m = in.Le<float>();
    row.speed_mps = in.Le<float>();
  }
  return ProfileFrom(record.time, std::move(rows));
}

std::optional<SonarInstallation> DecodeS7k7030(const S7kRecord& record) {
  ByteReader in(record.data);
  SonarInstallation out;
  out.time = record.time;
  out.model = "Reson " + std::to_string(record.device_id);
  out.values["frequency_hz"] = std::to_string(in.Le<float>());
  for (const char* name : {"firmware", "software", "7k", "protocol"})
    out.values[name] = ReadText(&in);
  out.transmitters.push_back({ReadMounting(&in), {Eigen::Vector3d::Zero()}});
  out.receivers.push_back({ReadMounting(&in), {Eigen::Vector3d::Zero()}});
  InstalledSensor motion{"motion", true, ReadMounting(&in), 0.0};
  motion.delay_s = in.Le<std::uint16_t>() / 1000.0;
  InstalledSensor position{"position", true, Eigen::Isometry3d::Identity(), 0.0};
  position.T_vehicle_sensor.translation() = ReadPlace(&in);
  position.delay_s = in.Le<std::uint16_t>() / 1000.0;
  out.water_line_m = -in.Le<float>();
  const bool usable = in.ok() && std::isfinite(out.water_line_m) &&
                      out.transmitters[0].T_vehicle_array.matrix().allFinite() &&
                      out.receivers[0].T_vehicle_array.matrix().allFinite() &&
                      motion.T_vehicle_sensor.matrix().allFinite() &&
                      position.T_vehicle_sensor.matrix().allFinite();
  if (!usable) return std::nullopt;
  out.sensors = {motion, position};
  return out;
}

}  // namespace seastitch
