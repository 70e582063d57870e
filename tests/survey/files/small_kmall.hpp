#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "codecs/kongsberg/kmall.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "common/core/pose.hpp"
#include "common/runtime/bus.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"

// Survey files for tests, and what is made of them.
namespace seastitch {

inline constexpr std::int64_t kNoon = 1'777'723'200'000'000;  // 2026-05-02T12:00:00Z

// Datagrams of a small .kmall.
class Kmall {
 public:
  Kmall& Profile(double t_s, double speed_mps = 1500.0) {
    return Add(EncodeSvp({At(t_s), {0.0, 50.0}, {speed_mps, speed_mps}}, KmallHeader{}));
  }
  Kmall& Installation(double water_line_m = 0.0) {
    SonarInstallation installation;
    installation.time = At(0.0);
    installation.transmitters.resize(1);
    installation.receivers.resize(1);
    installation.water_line_m = water_line_m;
    return Add(EncodeIip(installation, KmallHeader{}));
  }
  Kmall& Ping(double t_s, std::uint32_t number = 1, float twtt_s = 0.02f) {
    MbesPing ping;
    ping.time = At(t_s);
    ping.ping_number = number;
    ping.sound_speed_mps = 1500.0;
    ping.beams.resize(50, {twtt_s, 0.1f, 0, 0, 0, -20, kBeamValid | kBeamPhase});
    return Add(EncodeMrz(ping, KmallHeader{}));
  }
  // The clocks of the sensors to come are ahead of the sonar's by so much; of positions by whole
  // seconds.
  Kmall& SensorsAhead(double motion_s, int positions_s) {
    motion_ahead_s_ = motion_s;
    positions_ahead_s_ = positions_s;
    return *this;
  }
  // From t_s for a second: system 0 level, system 1 with 10 degrees of roll.
  Kmall& Motion(double t_s, int system = 0, int count = 20, bool with_position = false) {
    std::vector<NavigationRecord> samples;
    for (int i = 0; i < count; ++i) {
      NavigationRecord sample = Sample(t_s + motion_ahead_s_ + i / double(count));
      if (!with_position) sample.position.reset();
      sample.attitude =
          Attitude{Eigen::Quaterniond(RotationFromRpy(Deg2Rad(10.0 * system), 0.0, 0.0))};
      sample.heave_m = heave_m_;
      samples.push_back(sample);
    }
    auto datagram = EncodeSkm(samples, KmallHeader{});
    datagram[22] = static_cast<std::uint8_t>(system);
    return Add(datagram);
  }
  // The same, on the spot at 0.1 rad/s, with the velocity of a sensor ahead of the reference point.
  Kmall& Turning(double t_s, double ahead_m) {
    constexpr double kRateRadps = 0.1;
    std::vector<NavigationRecord> samples;
    for (int i = 0; i < 20; ++i) {
      NavigationRecord sample = Sample(t_s + i / 20.0);
      const double yaw_rad = kRateRadps * (t_s + i / 20.0);
      sample.attitude = Attitude{Eigen::Quaterniond(RotationFromRpy(0.0, 0.0, yaw_rad))};
      sample.velocity = GeoVelocity{kRateRadps * ahead_m *
                                    Eigen::Vector3d(-std::sin(yaw_rad), std::cos(yaw_rad), 0.0)};
      sample.heave_m = 5.0;
      samples.push_back(sample);
    }
    return Add(EncodeSkm(samples, KmallHeader{}));
  }
  // Heave of the motion to come.
  Kmall& Heave(double heave_m) {
    heave_m_ = heave_m;
    return *this;
  }
  Kmall& Position(double t_s, int system = 0, bool valid = true) {
    auto datagram = EncodeSpo(Sample(t_s), KmallHeader{});
    datagram[22] = static_cast<std::uint8_t>(system);
    if (!valid) datagram[24] |= 1 << 4;
    std::uint32_t stamp_s = 0;
    std::memcpy(&stamp_s, &datagram[28], sizeof stamp_s);
    stamp_s += static_cast<std::uint32_t>(positions_ahead_s_);
    std::memcpy(&datagram[28], &stamp_s, sizeof stamp_s);
    return Add(datagram);
  }
  // The clock that sets the sonar's, ahead of it by so much.
  Kmall& Clock(double t_s, double ahead_s) {
    const std::string text = "$GPZDA," + UtcText(At(t_s + ahead_s), "%H%M%S") +
                             std::to_string(std::fmod(ahead_s, 1.0)).substr(1) +
                             UtcText(At(t_s + ahead_s), ",%d,%m,%Y,00,00");
    ByteWriter out;
    WriteKmallHeader({.type = {'#', 'S', 'C', 'L'}, .version = 1}, At(t_s), &out);
    for (const int value : {8, 0, 1, 0}) out.Le(static_cast<std::uint16_t>(value));
    out.Le(0.0f);
    out.Le(std::int32_t{0});
    out.Append(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
    return Add(SealKmall(&out));
  }
  Kmall& PositionAt(double t_s, const GeoPosition& position) {
    NavigationRecord sample = Sample(t_s);
    sample.position = position;
    return Add(EncodeSpo(sample, KmallHeader{}));
  }
  // A position of a receiver without a fix.
  Kmall& PositionAtZero(double t_s) { return PositionAt(t_s, {}); }
  // A datagram of another type, of that size.
  Kmall& Foreign(const std::string& type, std::size_t bytes) {
    std::string datagram = bytes_.substr(0, 20);
    datagram.replace(4, 4, type);
    datagram.resize(bytes, '\0');
    const auto size = static_cast<std::uint32_t>(bytes);
    datagram.replace(0, 4, reinterpret_cast<const char*>(&size), 4);
    datagram.replace(bytes - 4, 4, reinterpret_cast<const char*>(&size), 4);
    bytes_ += datagram;
    return *this;
  }
  // With this text in the installation in place of that.
  Kmall& Replace(const std::string& text, const std::string& by) {
    EXPECT_EQ(text.size(), by.size());
    bytes_.replace(bytes_.find(text), text.size(), by);
    return *this;
  }
  Kmall& Survey(double from_s = 0.0) {
    Installation().Profile(from_s);
    for (int i = 0; i < 5; ++i) Motion(from_s + i).Position(from_s + i).Ping(from_s + i + 0.5);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

  static Time At(double t_s) { return FromUtime(kNoon) + FromSeconds(t_s); }

 private:
  static NavigationRecord Sample(double t_s) {
    NavigationRecord sample;
    sample.time = At(t_s);
    sample.position = GeoPosition{Deg2Rad(57.0 + 1e-5 * t_s), Deg2Rad(5.0), {1.0, 1.0}};
    return sample;
  }
  Kmall& Add(const std::vector<std::uint8_t>& datagram) {
    bytes_.append(datagram.begin(), datagram.end());
    return *this;
  }
  std::string bytes_;
  double heave_m_ = 5.0;
  double motion_ahead_s_ = 0.0;
  int positions_ahead_s_ = 0;
};

// Counters after the whole survey is read, and the number of samples of each kind.
struct Played {
  explicit Played(const std::vector<std::filesystem::path>& files) : survey(PlanSurvey(files)) {
    while (const auto received = survey.Next())
      ++samples[std::visit([](const auto& sample) { return NameOf(sample); }, received->sample)];
    counters = survey.counters();
  }
  std::int64_t Count(const std::string& name) const {
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  }
  SurveyFiles survey;
  std::map<std::string, int> samples;
  Counters counters;
};

inline CommandResult Replay(const std::string& inputs, const std::filesystem::path& out) {
  return RunCommand(Program("seastitch") + " replay --quiet " + inputs + " --out " + out.string());
}

}  // namespace seastitch
