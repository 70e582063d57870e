#include "codecs/makers/s7k_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "codecs/makers/s7k.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

void WritePlace(const Eigen::Vector3d& forward_starboard_down_m, ByteWriter* out) {
  out->Le(static_cast<float>(forward_starboard_down_m.y()));
  out->Le(static_cast<float>(forward_starboard_down_m.x()));
  out->Le(static_cast<float>(-forward_starboard_down_m.z()));
}

// 0 to 2 pi [rad].
float Compass(double angle_rad) {
  return static_cast<float>(angle_rad < 0.0 ? angle_rad + 2.0 * kPi : angle_rad);
}

void WriteMounting(const Eigen::Isometry3d& pose, ByteWriter* out) {
  WritePlace(pose.translation(), out);
  for (const double angle_rad : RpyFromRotation(pose.linear()))
    out->Le(static_cast<float>(angle_rad));
}

}  // namespace

std::vector<std::uint8_t> EncodeS7k1003(const NavigationRecord& sample) {
  const GeoPosition position = sample.position.value_or(GeoPosition{});
  ByteWriter data;
  data.Le(std::uint32_t{0});  // WGS 84
  data.Le(0.0f);              // latency
  data.Le(position.latitude_rad);
  data.Le(position.longitude_rad);
  data.Le(sample.height_m.value_or(0.0));
  data.Zeros(4);  // geographic, no zone, no quality, no method
  return EncodeS7kRecord(1003, S7kPingId{}, sample.time, data.bytes());
}

std::vector<std::uint8_t> EncodeS7k1015(const NavigationRecord& sample) {
  constexpr std::uint8_t kEllipsoid = 1;
  const GeoPosition position = sample.position.value_or(GeoPosition{});
  const Eigen::Vector2d v_mps =
      sample.velocity.value_or(GeoVelocity{}).v_ned_mps.head<2>();  // north, east
  ByteWriter data;
  data.Le(sample.height_m ? kEllipsoid : std::uint8_t{0});
  data.Le(position.latitude_rad);
  data.Le(position.longitude_rad);
  data.Le(static_cast<float>(position.sigma_north_east_m.maxCoeff()));
  data.Le(static_cast<float>(sample.height_m.value_or(0.0)));
  data.Le(0.0f);  // accuracy of the height
  data.Le(static_cast<float>(v_mps.norm()));
  data.Le(Compass(std::atan2(v_mps.y(), v_mps.x())));
  data.Le(Compass(sample.heading_rad.value_or(0.0)));
  return EncodeS7kRecord(1015, S7kPingId{}, sample.time, data.bytes());
}

std::vector<std::uint8_t> EncodeS7k1016(const std::vector<NavigationRecord>& samples) {
  if (samples.empty() || samples.size() > 255 ||
      samples.back().time - samples.front().time > std::chrono::seconds(65))
    throw std::invalid_argument("1016: 1 to 255 samples within 65 s");
  const Time begin =
      Time(std::chrono::floor<std::chrono::milliseconds>(samples.front().time.time_since_epoch()));
  ByteWriter data;
  data.Le(static_cast<std::uint8_t>(samples.size()));
  for (const NavigationRecord& sample : samples) {
    const Eigen::Vector3d rpy =
        RpyFromRotation(sample.attitude.value_or(Attitude{}).q_ned_imu.toRotationMatrix());
    const auto after = std::chrono::round<std::chrono::milliseconds>(sample.time - begin);
    data.Le(static_cast<std::uint16_t>(after.count()));
    data.Le(static_cast<float>(rpy.x()));
    data.Le(static_cast<float>(rpy.y()));
    data.Le(static_cast<float>(-sample.heave_m.value_or(0.0)));
    data.Le(Compass(rpy.z()));
  }
  return EncodeS7kRecord(1016, S7kPingId{}, begin, data.bytes());
}

std::vector<std::uint8_t> EncodeS7k1009(const SoundVelocityProfile& profile) {
  const std::size_t count = std::min(profile.depth_m.size(), profile.speed_mps.size());
  ByteWriter data;
  data.Zeros(20);  // no position
  data.Le(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    data.Le(static_cast<float>(profile.depth_m[i]));
    data.Le(static_cast<float>(profile.speed_mps[i]));
  }
  return EncodeS7kRecord(1009, S7kPingId{}, profile.time, data.bytes());
}

std::vector<std::uint8_t> EncodeS7k7030(const SonarInstallation& installation) {
  ByteWriter data;
  data.Le(400'000.0f);  // frequency
  for (int text = 0; text < 4; ++text) data.Zeros(2 + 128);
  const InstalledArray* const tx = installation.TransmitterOf(0);
  const InstalledArray* const rx = installation.ReceiverOf(0);
  WriteMounting(tx == nullptr ? Eigen::Isometry3d::Identity() : tx->At(0), &data);
  WriteMounting(rx == nullptr ? Eigen::Isometry3d::Identity() : rx->At(0), &data);
  WriteMounting(Eigen::Isometry3d::Identity(), &data);  // motion sensor
  data.Le(std::uint16_t{0});
  WritePlace(Eigen::Vector3d::Zero(), &data);  // positioning
  data.Le(std::uint16_t{0});
  data.Le(static_cast<float>(-installation.water_line_m));
  return EncodeS7kRecord(7030, S7kPingId{}, installation.time, data.bytes());
}

}  // namespace seastitch
