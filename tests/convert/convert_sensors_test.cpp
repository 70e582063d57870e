#include "common/convert/convert.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

#include "tests/convert/damage.hpp"
#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

using namespace examples;

TEST(ConvertImu, GivesBackTheSample) {
  const imu_t msg = Wire(ToLcm(Imu(), kStamp));
  EXPECT_EQ(msg.utime, ToUtime(kTime));
  EXPECT_EQ(msg.recv_utime, ToUtime(kStamp.recv));
  EXPECT_EQ(msg.seq, 42);
  const auto sample = FromLcm(msg);
  ASSERT_TRUE(sample && sample->attitude);
  EXPECT_EQ(sample->time, kTime);
  EXPECT_EQ(sample->angular_rate_radps, Imu().angular_rate_radps);
  EXPECT_EQ(sample->specific_force_mps2, Imu().specific_force_mps2);
  EXPECT_EQ(sample->attitude->q_ned_imu.coeffs(), Imu().attitude->q_ned_imu.coeffs());
  EXPECT_EQ(sample->attitude->sigma_rpy_rad, Imu().attitude->sigma_rpy_rad);
  EXPECT_EQ(sample->alignment, HeadingAlignment::kAligned);
}

TEST(ConvertImu, WithoutAttitudeHasNone) {
  ImuSample sample = Imu();
  sample.attitude.reset();
  const auto back = FromLcm(Wire(ToLcm(sample, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->attitude);
}

TEST(ConvertImu, NormalisesAQuaternionThatNearlyIsOne) {
  imu_t msg = ToLcm(Imu(), kStamp);
  for (double& value : msg.q_ned_imu) value *= 1.0009;
  const auto sample = FromLcm(msg);
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->attitude->q_ned_imu.norm(), 1.0, 1e-15);
}

TEST(ConvertImu, RefusesEachDamage) {
  ExpectEachRefused<imu_t>(
      ToLcm(Imu(), kStamp),
      {{"rate NaN", [](imu_t& m) { m.angular_rate_radps[2] = kNan; }},
       {"force infinite", [](imu_t& m) { m.specific_force_mps2[0] = kInf; }},
       {"no quaternion", [](imu_t& m) { m.q_ned_imu[0] = 0.9; }},
       {"quaternion NaN", [](imu_t& m) { m.q_ned_imu[3] = kNan; }},
       {"sigma negative", [](imu_t& m) { m.sigma_roll_pitch_yaw_rad[1] = -0.1; }},
       {"alignment unknown", [](imu_t& m) { m.alignment = 3; }},
       {"alignment negative", [](imu_t& m) { m.alignment = -1; }},
       {"time before 1970", [](imu_t& m) { m.utime = -1; }},
       {"time in the far future",
        [](imu_t& m) { m.utime = std::numeric_limits<int64_t>::max(); }}});
}

TEST(ConvertDvl, GivesBackTheSample) {
  const auto sample = FromLcm(Wire(ToLcm(Dvl(), kStamp)));
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->bottom_lock);
  EXPECT_EQ(sample->v_dvl_mps, Dvl().v_dvl_mps);
  EXPECT_EQ(sample->sigma_v_mps, Dvl().sigma_v_mps);
  EXPECT_TRUE(sample->beams[2].valid);
  EXPECT_EQ(sample->beams[2].range_m, 25.5);
  EXPECT_EQ(sample->beams[2].velocity_mps, 0.3);
  EXPECT_EQ(sample->altitude_m, 22.0);
  EXPECT_EQ(sample->beams[3].quality, 0.9);
  EXPECT_EQ(sample->error_velocity_mps, -0.02);
}

TEST(ConvertDvl, WithoutQualityAndErrorVelocityHasNone) {
  DvlSample sample = Dvl();
  sample.beams[1].quality.reset();  // all beams have one or none
  sample.error_velocity_mps.reset();
  const auto back = FromLcm(Wire(ToLcm(sample, kStamp)));
  ASSERT_TRUE(back);
  for (const DvlBeam& beam : back->beams) EXPECT_FALSE(beam.quality);
  EXPECT_FALSE(back->error_velocity_mps);
}

TEST(ConvertDvl, WithoutLockHasNoVelocity) {
  dvl_t msg = ToLcm(Dvl(), kStamp);
  msg.bottom_lock = 0;  // a sender that forgot to clear what means nothing
  msg.has_altitude = 0;
  const auto sample = FromLcm(msg);
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->v_dvl_mps.isZero());
  EXPECT_FALSE(sample->altitude_m);
}

TEST(ConvertDvl, RefusesEachDamage) {
  ExpectEachRefused<dvl_t>(
      ToLcm(Dvl(), kStamp),
      {{"velocity NaN", [](dvl_t& m) { m.v_dvl_mps[0] = kNan; }},
       {"sigma negative", [](dvl_t& m) { m.sigma_v_mps[0] = -1.0; }},
       {"range negative", [](dvl_t& m) { m.beam_range_m[0] = -1.0; }},
       {"beam velocity infinite", [](dvl_t& m) { m.beam_velocity_mps[3] = -kInf; }},
       {"quality above one", [](dvl_t& m) { m.beam_quality[2] = 1.01; }},
       {"quality NaN", [](dvl_t& m) { m.beam_quality[2] = kNan; }},
       {"error velocity NaN", [](dvl_t& m) { m.error_velocity_mps = kNan; }},
       {"altitude NaN", [](dvl_t& m) { m.altitude_m = kNan; }}});
}

TEST(ConvertDepth, GivesBackTheSampleAndRefusesEachDamage) {
  const DepthSample depth{kTime, 1.2e5, 12.0, 0.05};
  const auto back = FromLcm(Wire(ToLcm(depth, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->depth_m, 12.0);
  EXPECT_EQ(back->pressure_pa, 1.2e5);
  EXPECT_EQ(back->sigma_m, 0.05);
  ExpectEachRefused<depth_t>(ToLcm(depth, kStamp),
                             {{"depth NaN", [](depth_t& m) { m.depth_m = kNan; }},
                              {"pressure NaN", [](depth_t& m) { m.pressure_pa = kNan; }},
                              {"sigma negative", [](depth_t& m) { m.sigma_m = -1; }}});
}

TEST(ConvertDepth, WithoutPressureHasNone) {
  const auto back = FromLcm(Wire(ToLcm(DepthSample{kTime, {}, 12.0, 0.05}, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->pressure_pa);
}

TEST(ConvertMbes, GivesBackThePingAlsoTheLargest) {
  for (const int beams : {0, 1, kMaxBeams}) {
    const MbesPing ping = Ping(beams);
    const mbes_ping_t msg = Wire(ToLcm(ping, kStamp));
    EXPECT_LT(msg.getEncodedSize(), 60'000);
    const auto back = FromLcm(msg);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->ping_number, ping.ping_number);
    EXPECT_EQ(back->sound_speed_mps, ping.sound_speed_mps);
    EXPECT_EQ(back->head, ping.head);
    ASSERT_EQ(back->beams.size(), ping.beams.size());
    for (std::size_t i = 0; i < ping.beams.size(); ++i) {
      EXPECT_EQ(back->beams[i].twtt_s, ping.beams[i].twtt_s);
      EXPECT_EQ(back->beams[i].rx_angle_rad, ping.beams[i].rx_angle_rad);
      EXPECT_EQ(back->beams[i].tx_tilt_rad, ping.beams[i].tx_tilt_rad);
      EXPECT_EQ(back->beams[i].tx_delay_s, ping.beams[i].tx_delay_s);
      EXPECT_EQ(back->beams[i].depth_sigma_ratio, ping.beams[i].depth_sigma_ratio);
      EXPECT_EQ(back->beams[i].backscatter_db, ping.beams[i].backscatter_db);
      EXPECT_EQ(back->beams[i].flags, ping.beams[i].flags);
      EXPECT_EQ(back->beams[i].tx_array, ping.beams[i].tx_array);
    }
  }
}

void Grow(int beams, mbes_ping_t* msg) {
  const auto n = static_cast<std::size_t>(beams);
  msg->num_beams = beams;
  for (auto* list : {&msg->twtt_s,
                     &msg->rx_angle_rad,
                     &msg->tx_tilt_rad,
                     &msg->tx_delay_s,
                     &msg->depth_sigma_ratio,
                     &msg->backscatter_db})
    list->resize(n);
  msg->flags.resize(n);
  msg->tx_array.resize(n);
}

TEST(ConvertMbes, ThinsAFanThatDoesNotFitAndKeepsItsEdges) {
  for (const int beams : {kMaxBeams + 1, 3 * kMaxBeams, 100'000}) {
    const MbesPing ping = Ping(beams);
    const mbes_ping_t msg = ToLcm(ping, kStamp);
    EXPECT_EQ(msg.num_beams, kMaxBeams);
    EXPECT_EQ(msg.rx_angle_rad.front(), ping.beams.front().rx_angle_rad);
    EXPECT_EQ(msg.rx_angle_rad.back(), ping.beams.back().rx_angle_rad);
    for (std::size_t i = 1; i < msg.rx_angle_rad.size(); ++i)
      EXPECT_GT(msg.rx_angle_rad[i], msg.rx_angle_rad[i - 1]);
  }
}

TEST(ConvertMbes, RefusesEachDamage) {
  ExpectEachRefused<mbes_ping_t>(
      ToLcm(Ping(20), kStamp),
      {{"too many beams", [](mbes_ping_t& m) { Grow(kMaxBeams + 1, &m); }},
       {"head negative", [](mbes_ping_t& m) { m.head = -1; }},
       {"sectors short", [](mbes_ping_t& m) { m.tx_array.pop_back(); }},
       {"count above the arrays", [](mbes_ping_t& m) { m.num_beams = 21; }},
       {"count negative", [](mbes_ping_t& m) { m.num_beams = -1; }},
       {"one array short", [](mbes_ping_t& m) { m.flags.pop_back(); }},
       {"sound speed negative", [](mbes_ping_t& m) { m.sound_speed_mps = -1.0; }},
       {"sound speed NaN", [](mbes_ping_t& m) { m.sound_speed_mps = kNan; }},
       {"travel time negative", [](mbes_ping_t& m) { m.twtt_s[5] = -0.1f; }},
       {"travel time NaN", [](mbes_ping_t& m) { m.twtt_s[5] = kNanF; }},
       {"travel time beyond any sea", [](mbes_ping_t& m) { m.twtt_s[5] = 41.0f; }},
       {"delay negative", [](mbes_ping_t& m) { m.tx_delay_s[5] = -0.1f; }},
       {"angle in degrees", [](mbes_ping_t& m) { m.rx_angle_rad[5] = 60.0f; }},
       {"angle NaN", [](mbes_ping_t& m) { m.rx_angle_rad[5] = kNanF; }},
       {"tilt NaN", [](mbes_ping_t& m) { m.tx_tilt_rad[5] = kNanF; }},
       {"delay NaN", [](mbes_ping_t& m) { m.tx_delay_s[5] = kNanF; }},
       {"sigma negative", [](mbes_ping_t& m) { m.depth_sigma_ratio[5] = -1.0f; }},
       {"backscatter NaN", [](mbes_ping_t& m) { m.backscatter_db[5] = kNanF; }},
       {"ping number negative", [](mbes_ping_t& m) { m.ping_number = -1; }},
       {"ping number beyond 32 bit", [](mbes_ping_t& m) { m.ping_number = 1LL << 32; }}});
}

TEST(ConvertPing, LetsASoundSpeedThroughThatThereIsNoSeaFor) {
  MbesPing ping = Ping(20);
  ping.sound_speed_mps = 340.0;  // a probe in air: geo-referencing takes the profile instead
  const auto back = FromLcm(ToLcm(ping, kStamp));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->sound_speed_mps, 340.0);
}

TEST(ConvertSoundings, GiveBackThePing) {
  for (const int soundings : {0, 1, kMaxSoundings}) {
    const std::vector<mbes_soundings_t> messages = ToLcm(Soundings(soundings), kStamp);
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_EQ(messages[0].seq, 42);
    const auto back = FromLcm(Wire(messages[0]));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->time, kTime);
    EXPECT_EQ(back->ping_number, 7u);
    EXPECT_EQ(back->head, 1);
    ASSERT_EQ(back->soundings.size(), static_cast<std::size_t>(soundings));
    for (const LevelSounding& sounding : back->soundings) {
      EXPECT_EQ(sounding.p_level_m.z(), 20.0f);
      EXPECT_EQ(sounding.sigma_z_m, 0.1f);
      EXPECT_EQ(sounding.flags, kBeamValid);
    }
  }
}

TEST(ConvertSoundings, ComeInSeveralMessagesWhereOneCannotHoldThem) {
  const SoundingPing ping = Soundings(2 * kMaxSoundings + 1);
  const std::vector<mbes_soundings_t> messages = ToLcm(ping, kStamp);
  ASSERT_EQ(messages.size(), 3u);
  std::vector<LevelSounding> together;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    EXPECT_EQ(messages[i].seq, 42 + static_cast<int>(i));
    const auto part = FromLcm(Wire(messages[i]));
    ASSERT_TRUE(part);
    EXPECT_EQ(part->time, ping.time);
    EXPECT_EQ(part->ping_number, ping.ping_number);
    together.insert(together.end(), part->soundings.begin(), part->soundings.end());
  }
  ASSERT_EQ(together.size(), ping.soundings.size());
  for (std::size_t i = 0; i < together.size(); ++i)
    EXPECT_EQ(together[i].p_level_m, ping.soundings[i].p_level_m);
}

TEST(ConvertSoundings, RefuseEachDamage) {
  using M = mbes_soundings_t;
  ExpectEachRefused<M>(ToLcm(Soundings(3), kStamp)[0],
                       {{"time", [](M& m) { m.utime = -1; }},
                        {"head negative", [](M& m) { m.head = -1; }},
                        {"ping number negative", [](M& m) { m.ping_number = -1; }},
                        {"count negative", [](M& m) { m.num_soundings = -1; }},
                        {"count above the arrays", [](M& m) { m.num_soundings = 4; }},
                        {"array short", [](M& m) { m.flags.pop_back(); }},
                        {"NaN", [](M& m) { m.z_m[1] = kNanF; }},
                        {"beyond any sea", [](M& m) { m.y_m[1] = 20'000.0f; }},
                        {"sigma negative", [](M& m) { m.sigma_z_m[1] = -0.1f; }}});
}

TEST(ConvertNavigation, GivesBackTheSample) {
  const auto back = FromLcm(Wire(ToLcm(Navigation(), kStamp)));
  ASSERT_TRUE(back && back->position && back->depth && back->height && back->attitude &&
              back->velocity);
  EXPECT_EQ(back->time, kTime);
  EXPECT_EQ(back->status, InsStatus::kAided);
  EXPECT_EQ(back->source, "phins");
  EXPECT_EQ(back->position->latitude_rad, 0.75);
  EXPECT_EQ(back->position->longitude_rad, -1.2);
  EXPECT_EQ(back->position->sigma_north_east_m, Eigen::Vector2d(1.5, 2.5));
  EXPECT_EQ(back->depth->value_m, 12.0);
  EXPECT_EQ(back->depth->sigma_m, 0.1);
  EXPECT_EQ(back->height->value_m, -12.5);
  EXPECT_EQ(back->height->sigma_m, 0.2);
  EXPECT_EQ(back->attitude->sigma_rpy_rad, Navigation().attitude->sigma_rpy_rad);
  EXPECT_EQ(back->velocity->v_ned_mps, Navigation().velocity->v_ned_mps);
  EXPECT_EQ(back->velocity->sigma_ned_mps, Navigation().velocity->sigma_ned_mps);
}

TEST(ConvertNavigation, WhatIsNotGivenIsAbsent) {
  NavigationSample sample;
  sample.time = kTime;
  const auto back = FromLcm(Wire(ToLcm(sample, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->position || back->depth || back->height || back->attitude || back->velocity);
  EXPECT_EQ(back->status, InsStatus::kUnknown);
}

TEST(ConvertNavigation, RefusesEachDamage) {
  using M = navigation_t;
  ExpectEachRefused<M>(ToLcm(Navigation(), kStamp),
                       {{"time", [](M& m) { m.utime = -1; }},
                        {"status unknown", [](M& m) { m.status = 5; }},
                        {"status negative", [](M& m) { m.status = -1; }},
                        {"latitude in degrees", [](M& m) { m.latitude_rad = 43.0; }},
                        {"longitude NaN", [](M& m) { m.longitude_rad = kNan; }},
                        {"sigma negative", [](M& m) { m.sigma_east_m = -1.0; }},
                        {"depth NaN", [](M& m) { m.depth_m = kNan; }},
                        {"height infinite", [](M& m) { m.height_m = kInf; }},
                        {"no quaternion", [](M& m) { m.q_ned_ins[0] = 0.9; }},
                        {"velocity NaN", [](M& m) { m.v_ned_mps[1] = kNan; }},
                        {"velocity sigma negative", [](M& m) { m.sigma_v_ned_mps[1] = -0.1; }},
                        {"endless source", [](M& m) { m.source = std::string(257, 'x'); }}});
}

TEST(ConvertProfile, ThinsWhatDoesNotFitAndKeepsSurfaceAndBottom) {
  SoundVelocityProfile profile{kTime, {}, {}};
  for (int i = 0; i < 5 * kMaxProfileSamples; ++i) {
    profile.depth_m.push_back(0.1 * i);
    profile.speed_mps.push_back(1500.0);
  }
  const auto back = FromLcm(Wire(ToLcm(profile, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->depth_m.size(), static_cast<std::size_t>(kMaxProfileSamples));
  EXPECT_EQ(back->depth_m.front(), profile.depth_m.front());
  EXPECT_EQ(back->depth_m.back(), profile.depth_m.back());
}

TEST(ConvertProfile, GivesBackTheProfileAndRefusesEachDamage) {
  const SoundVelocityProfile profile{kTime, {0.0, 10.0, 50.0}, {1500.0, 1490.0, 1485.0}};
  const auto back = FromLcm(Wire(ToLcm(profile, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->depth_m, profile.depth_m);
  EXPECT_EQ(back->speed_mps, profile.speed_mps);
  using M = sound_velocity_profile_t;
  ExpectEachRefused<M>(ToLcm(profile, kStamp),
                       {{"depth twice", [](M& m) { m.depth_m[1] = 0.0; }},
                        {"depth falling", [](M& m) { m.depth_m[2] = 5.0; }},
                        {"depth NaN", [](M& m) { m.depth_m[1] = kNan; }},
                        {"speed zero", [](M& m) { m.speed_mps[1] = 0.0; }},
                        {"speed NaN", [](M& m) { m.speed_mps[1] = kNan; }},
                        {"empty",
                         [](M& m) {
                           m = ToLcm(SoundVelocityProfile{kTime, {}, {}}, kStamp);
                         }},
                        {"array short", [](M& m) { m.speed_mps.pop_back(); }}});
}

TEST(ConvertFix, GivesBackTheFixAndRefusesEachDamage) {
  PositionFix fix{{0.75, -1.2}, kTime, Eigen::Matrix2d::Identity() * 4.0, "gps"};
  fix.covariance_north_east_m2(0, 1) = fix.covariance_north_east_m2(1, 0) = 1.5;
  const auto back = FromLcm(Wire(ToLcm(fix, kStamp)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->latitude_rad, 0.75);
  EXPECT_EQ(back->longitude_rad, -1.2);
  EXPECT_EQ(back->covariance_north_east_m2, fix.covariance_north_east_m2);
  EXPECT_EQ(back->source, "gps");
  using M = position_fix_t;
  ExpectEachRefused<M>(ToLcm(fix, kStamp),
                       {{"latitude in degrees", [](M& m) { m.latitude_rad = 43.0; }},
                        {"latitude NaN", [](M& m) { m.latitude_rad = kNan; }},
                        {"longitude in degrees", [](M& m) { m.longitude_rad = -70.0; }},
                        {"no scatter", [](M& m) { m.variance_north_m2 = 0.0; }},
                        {"variance NaN", [](M& m) { m.variance_east_m2 = kNan; }},
                        {"not positive definite", [](M& m) { m.covariance_north_east_m2 = 4.1; }},
                        {"endless source", [](M& m) { m.source = std::string(10'000, 'x'); }}});
}

TEST(ToRawParts, CutsAndNumbersSoThatNothingIsLost) {
  for (const std::size_t size : {0u, 1u, 50'000u, 50'001u, 170'000u}) {
    std::vector<std::uint8_t> bytes(size);
    std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
    const auto parts = ToRawParts(bytes, "udp:127.0.0.1:6020", kTime, 10);
    std::vector<std::uint8_t> together;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_LT(parts[i].getEncodedSize(), 60'000);
      EXPECT_EQ(parts[i].part, static_cast<int>(i));
      EXPECT_EQ(parts[i].num_parts, static_cast<int>(parts.size()));
      EXPECT_EQ(parts[i].seq, 10 + static_cast<int>(i));
      EXPECT_EQ(parts[i].recv_utime, ToUtime(kTime));
      together.insert(together.end(), parts[i].data.begin(), parts[i].data.end());
    }
    EXPECT_EQ(together, bytes);
  }
}

}  // namespace
}  // namespace seastitch
