// What the writers of .all and .s7k write, read by the readers that read real files.
#include <gtest/gtest.h>

#include <cmath>

#include "codecs/kongsberg/em_all_file.hpp"
#include "codecs/kongsberg/em_all_writer.hpp"
#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_file.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/core/pose.hpp"
#include "tests/codecs/survey_files.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kMidnight = 1'714'608'000'000'000;  // 2024-05-02

MbesPing Ping(std::int64_t utime) {
  MbesPing ping;
  ping.time = FromUtime(utime);
  ping.ping_number = 77;
  ping.sound_speed_mps = 1487.3;
  for (int i = -3; i <= 3; ++i) {
    MbesBeam beam;
    beam.twtt_s = 0.05f + 0.001f * static_cast<float>(i * i);
    beam.rx_angle_rad = static_cast<float>(Deg2Rad(20.0 * i));
    beam.tx_tilt_rad = static_cast<float>(Deg2Rad(i < 0 ? 1.25 : -0.5));
    beam.tx_delay_s = i < 0 ? 0.0f : 0.0015f;
    beam.depth_sigma_ratio = 0.004f;
    beam.backscatter_db = -21.5f;
    beam.flags = i == 2 ? kBeamAmplitude : kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

NavigationRecord Motion(std::int64_t utime, double heading_deg) {
  NavigationRecord sample;
  sample.time = FromUtime(utime);
  sample.attitude = Attitude{
      Eigen::Quaterniond(RotationFromRpy(Deg2Rad(2.0), Deg2Rad(-1.5), Deg2Rad(heading_deg)))};
  sample.heave_m = 12.34;
  sample.position = GeoPosition{Deg2Rad(43.07123456), Deg2Rad(-70.70765432), {0.5, 0.5}};
  sample.velocity = GeoVelocity{{1.0, -1.0, 0.0}};
  return sample;
}

SonarInstallation Installation() {
  SonarInstallation installation;
  installation.time = FromUtime(kMidnight);
  installation.transmitters.push_back(
      {MakePose({0.9, 0.1, 0.2}, RotationFromRpy(0.01, -0.02, 0.03))});
  installation.receivers.push_back({MakePose({0.7, -0.1, 0.25}, RotationFromRpy(0.02, 0.01, 0.0))});
  return installation;
}

void ExpectBeams(const MbesPing& got, const MbesPing& sent, double angle_rad, bool sectors) {
  ASSERT_EQ(got.beams.size(), sent.beams.size());
  for (std::size_t i = 0; i < sent.beams.size(); ++i) {
    EXPECT_NEAR(got.beams[i].twtt_s, sent.beams[i].twtt_s, 1e-7);
    EXPECT_NEAR(got.beams[i].rx_angle_rad, sent.beams[i].rx_angle_rad, angle_rad);
    EXPECT_EQ(got.beams[i].flags & kBeamValid, sent.beams[i].flags & kBeamValid) << i;
    if (!sectors) continue;
    EXPECT_NEAR(got.beams[i].tx_tilt_rad, sent.beams[i].tx_tilt_rad, angle_rad);
    EXPECT_EQ(got.beams[i].tx_delay_s, sent.beams[i].tx_delay_s);
  }
}

void ExpectMotion(const NavigationRecord& got, const NavigationRecord& sent, double angle_rad) {
  EXPECT_NEAR(ToSeconds(got.time - sent.time), 0.0, 0.0006);
  ASSERT_TRUE(got.attitude && got.heave_m);
  EXPECT_LT(got.attitude->q_ned_imu.angularDistance(sent.attitude->q_ned_imu), 2.0 * angle_rad);
  EXPECT_NEAR(*got.heave_m, *sent.heave_m, 0.0051);
}

template <class Reader>
SurveyContents ReadBack(std::initializer_list<std::vector<std::uint8_t>> parts) {
  ByteVector file;
  for (const auto& part : parts) file.insert(file.end(), part.begin(), part.end());
  Reader reader;
  return ReadSurvey(file, &reader);
}

// Over midnight, by a millisecond and by half of one.
TEST(EmAllWriter, IsReadBackWithinItsRounding) {
  const double step_rad = Deg2Rad(0.006);
  for (const std::int64_t utime : {kMidnight + 500, kMidnight - 700, kMidnight + 86'399'999'600}) {
    const MbesPing ping = Ping(utime);
    const std::vector<NavigationRecord> motion{
        Motion(utime, 359.999), Motion(utime + 20'000, 0.001), Motion(utime + 40'000, -90.0)};
    SoundVelocityProfile profile{FromUtime(kMidnight + 5'000'000), {0.0, 10.5}, {1490.0, 1485.2}};
    const auto file = ReadBack<EmAllFileReader>({EncodeEmI(Installation()),
                                                 EncodeEmU(profile),
                                                 EncodeEmA(motion),
                                                 EncodeEmP(motion[0]),
                                                 EncodeEmN(ping)});
    EXPECT_TRUE(file.counters.empty()) << file.counters.begin()->first;
    const auto pings = file.All<MbesPing>();
    ASSERT_EQ(pings.size(), 1u);
    EXPECT_NEAR(ToSeconds(pings[0].time - ping.time), 0.0, 0.0006);
    EXPECT_EQ(pings[0].ping_number, 77u);
    EXPECT_NEAR(pings[0].sound_speed_mps, 1487.3, 1e-9);
    ExpectBeams(pings[0], ping, step_rad, true);
    const auto navigation = file.All<NavigationRecord>();
    ASSERT_EQ(navigation.size(), 4u);
    for (std::size_t i = 0; i < 3; ++i) ExpectMotion(navigation[i], motion[i], step_rad);
    ASSERT_TRUE(navigation[3].position && navigation[3].velocity);
    EXPECT_NEAR(navigation[3].position->latitude_rad, motion[0].position->latitude_rad, 1e-9);
    EXPECT_NEAR(navigation[3].position->longitude_rad, motion[0].position->longitude_rad, 2e-9);
    EXPECT_NEAR(navigation[3].velocity->v_ned_mps.y(), -1.0, 0.006);
    const auto installations = file.All<SonarInstallation>();
    ASSERT_EQ(installations.size(), 1u);
    const SonarInstallation sent = Installation();
    EXPECT_TRUE(installations[0].transmitters[0].At(0).isApprox(sent.transmitters[0].At(0), 1e-4));
    EXPECT_TRUE(installations[0].receivers[0].At(0).isApprox(sent.receivers[0].At(0), 1e-4));
    const auto profiles = file.All<SoundVelocityProfile>();
    ASSERT_EQ(profiles.size(), 1u);
    EXPECT_EQ(profiles[0].time, profile.time);
    EXPECT_NEAR(profiles[0].speed_mps[1], 1485.2, 1e-9);
  }
}

TEST(EmAllWriter, RefusesWhatTheFormatCannotHold) {
  EXPECT_THROW(EncodeEmA({}), std::invalid_argument);
  EXPECT_THROW(EncodeEmA({Motion(0, 0.0), Motion(61'000'000, 0.0)}), std::invalid_argument);
  MbesPing ping = Ping(kMidnight);
  ping.beams.resize(2049);
  EXPECT_THROW(EncodeEmN(ping), std::invalid_argument);
}

TEST(S7kWriter, IsReadBackWithinItsRounding) {
  const MbesPing ping = Ping(kMidnight + 1'234'567);
  const std::vector<NavigationRecord> motion{Motion(kMidnight + 100, 359.999),
                                             Motion(kMidnight + 20'000, 0.001)};
  SoundVelocityProfile profile{FromUtime(kMidnight), {0.0, 10.5}, {1490.0, 1485.25}};
  NavigationRecord navigation_sent = motion[0];
  navigation_sent.heading_rad = Deg2Rad(-90.0);
  navigation_sent.height_m = -12.5;
  S7kPingId id;
  id.ping_number = ping.ping_number;
  const auto file = ReadBack<S7kFileReader>({EncodeS7k7030(Installation()),
                                             EncodeS7k1009(profile),
                                             EncodeS7k1016(motion),
                                             EncodeS7k1003(motion[0]),
                                             EncodeS7k1015(navigation_sent),
                                             EncodeS7k7000(id, ping.time, ping.sound_speed_mps),
                                             EncodeS7k7027(id, ping)});
  EXPECT_TRUE(file.counters.empty()) << file.counters.begin()->first;
  const auto pings = file.All<MbesPing>();
  ASSERT_EQ(pings.size(), 1u);
  ExpectBeams(pings[0], ping, 1e-6, false);
  const auto navigation = file.All<NavigationRecord>();
  ASSERT_EQ(navigation.size(), 4u);
  for (std::size_t i = 0; i < 2; ++i) ExpectMotion(navigation[i], motion[i], 1e-6);
  ASSERT_TRUE(navigation[2].position);
  EXPECT_NEAR(navigation[2].position->longitude_rad, motion[0].position->longitude_rad, 1e-12);
  ASSERT_TRUE(navigation[3].position && navigation[3].velocity && navigation[3].heading_rad);
  EXPECT_NEAR(navigation[3].position->latitude_rad, motion[0].position->latitude_rad, 1e-12);
  EXPECT_TRUE(navigation[3].velocity->v_ned_mps.isApprox(Eigen::Vector3d(1.0, -1.0, 0.0), 1e-6));
  EXPECT_NEAR(*navigation[3].heading_rad, Deg2Rad(270.0), 1e-6);
  EXPECT_EQ(navigation[3].height_m, -12.5);
  const auto installations = file.All<SonarInstallation>();
  ASSERT_EQ(installations.size(), 1u);
  const SonarInstallation sent = Installation();
  EXPECT_TRUE(installations[0].transmitters[0].At(0).isApprox(sent.transmitters[0].At(0), 1e-6));
  EXPECT_TRUE(installations[0].receivers[0].At(0).isApprox(sent.receivers[0].At(0), 1e-6));
  EXPECT_EQ(file.All<SoundVelocityProfile>().at(0).speed_mps[1], 1485.25);
  EXPECT_THROW(EncodeS7k1016({}), std::invalid_argument);
}

}  // namespace
}  // namespace seastitch
