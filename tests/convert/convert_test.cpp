#include "common/convert/convert.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();
using namespace examples;

// Through the wire: what a subscriber gets.
template <class Msg>
Msg Wire(const Msg& msg) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  EXPECT_EQ(msg.encode(bytes.data(), 0, static_cast<int>(bytes.size())), bytes.size());
  Msg copy{};
  EXPECT_EQ(copy.decode(bytes.data(), 0, static_cast<int>(bytes.size())), bytes.size());
  return copy;
}

// Every damage alone makes FromLcm refuse a message that it took before.
template <class Msg>
struct Damage {
  const char* name;
  std::function<void(Msg&)> apply;
};
template <class Msg>
void ExpectEachRefused(const Msg& good, const std::vector<Damage<Msg>>& damages) {
  ASSERT_TRUE(FromLcm(good)) << "the undamaged message";
  for (const Damage<Msg>& damage : damages) {
    Msg bad = good;
    damage.apply(bad);
    EXPECT_FALSE(FromLcm(bad)) << damage.name;
  }
}

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
       {"travel time beyond any sea", [](mbes_ping_t& m) { m.twtt_s[5] = 21.0f; }},
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
  PositionFix fix{kTime, 0.75, -1.2, Eigen::Matrix2d::Identity() * 4.0, "gps"};
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

TEST(ConvertNav, GivesBackTheState) {
  const auto back = FromLcm(Wire(ToLcm(Nav(), 7)));
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->T_map_vehicle.isApprox(Nav().T_map_vehicle, 1e-14));
  EXPECT_EQ(back->v_map_mps, Nav().v_map_mps);
  EXPECT_EQ(back->covariance, Nav().covariance);
  EXPECT_TRUE(back->bottom_lock);
}

TEST(ConvertNav, RefusesEachDamage) {
  using M = nav_t;
  ExpectEachRefused<M>(
      ToLcm(Nav(), 7),
      {{"position NaN", [](M& m) { m.p_map_vehicle_m[1] = kNan; }},
       {"position beyond the Earth", [](M& m) { m.p_map_vehicle_m[1] = 1e9; }},
       {"quaternion zero", [](M& m) { std::fill_n(m.q_map_vehicle, 4, 0.0); }},
       {"velocity NaN", [](M& m) { m.v_map_mps[1] = kNan; }},
       {"covariance NaN", [](M& m) { m.covariance_ned_rpy[2][3] = kNan; }},
       {"covariance not symmetric", [](M& m) { m.covariance_ned_rpy[0][5] = 0.1; }},
       {"variance negative", [](M& m) { m.covariance_ned_rpy[3][3] = -1e-9; }}});
}

TEST(ConvertNavCorrected, GivesBackTheStateAndRefusesEachDamage) {
  const auto back = FromLcm(Wire(ToLcm(Corrected(), 7)));
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->state.T_map_vehicle.isApprox(Nav().T_map_vehicle, 1e-14));
  EXPECT_EQ(back->state.covariance, Nav().covariance);
  EXPECT_EQ(back->T_map_nav.Vector(), Corrected().T_map_nav.Vector());
  EXPECT_EQ(back->graph_version, 5);
  EXPECT_EQ(back->jumps, 3);
  EXPECT_EQ(back->last_jump_m, 0.4);
  EXPECT_EQ(back->last_jump_yaw_rad, -0.01);
  using M = nav_corrected_t;
  ExpectEachRefused<M>(ToLcm(Corrected(), 7),
                       {{"time", [](M& m) { m.utime = -1; }},
                        {"quaternion zero", [](M& m) { std::fill_n(m.q_map_vehicle, 4, 0.0); }},
                        {"variance negative", [](M& m) { m.covariance_ned_rpy[3][3] = -1e-9; }},
                        {"velocity NaN", [](M& m) { m.v_map_mps[1] = kNan; }},
                        {"correction NaN", [](M& m) { m.correction_yaw_rad = kNan; }},
                        {"correction beyond the Earth", [](M& m) { m.correction_x_m = 1e9; }},
                        {"version negative", [](M& m) { m.graph_version = -1; }},
                        {"jumps negative", [](M& m) { m.jumps = -1; }},
                        {"jump negative", [](M& m) { m.last_jump_m = -1.0; }},
                        {"jump NaN", [](M& m) { m.last_jump_yaw_rad = kNan; }}});
}

TEST(ConvertGraphUpdate, GivesBackTheUpdate) {
  const auto back = FromLcm(Wire(ToLcm(Update(), kTime, 9)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->version, 3);
  EXPECT_EQ(back->graph_id, Update().graph_id);
  EXPECT_TRUE(back->final);
  EXPECT_TRUE(back->resumed);
  ASSERT_EQ(back->vertices.size(), 1u);
  EXPECT_EQ(back->vertices[0].chain, 1);
  EXPECT_EQ(back->vertices[0].id, SubmapId{4});
  EXPECT_EQ(back->vertices[0].dead_reckoned.Vector(), Eigen::Vector3d(10.0, 20.0, 0.5));
  EXPECT_EQ(back->vertices[0].heading_sigma_rad, 0.02);
  ASSERT_EQ(back->edges.size(), 2u);
  const GraphEdge& loop = back->edges[0];
  EXPECT_EQ(loop.kind, EdgeKind::kLoopClosure);
  EXPECT_EQ(loop.from, SubmapId{1});
  EXPECT_EQ(loop.to, SubmapId{4});
  EXPECT_EQ(loop.T_from_to.Vector(), Eigen::Vector3d(1.0, -2.0, 3.0));
  EXPECT_EQ(loop.information, Update().edges[0].information);
  EXPECT_EQ(loop.verdict, LoopVerdict::kPoorFit);
  EXPECT_EQ(loop.z_offset_m, -0.1);
  EXPECT_EQ(loop.rms_m, 0.05);
  EXPECT_EQ(loop.overlap_m2, 300.0);
  EXPECT_EQ(loop.overlap_center_m, Eigen::Vector2d(12.0, -7.0));
  EXPECT_EQ(back->mounting.sonar_m, 0.25);
  EXPECT_EQ(back->mounting.dvl_yaw_rad, 0.004);
  EXPECT_EQ(back->edges[1].kind, EdgeKind::kPositionFix);
}

TEST(ConvertGraphUpdate, AHeadingThatIsNotKnownStaysSo) {
  GraphUpdate update = Update();
  update.vertices[0].heading_sigma_rad.reset();
  const auto back = FromLcm(Wire(ToLcm(update, kTime, 9)));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->vertices[0].heading_sigma_rad);
}

TEST(ConvertGraphUpdate, StaysUnderOneDatagramAtItsLargest) {
  GraphUpdate update;
  update.version = 1;
  for (int i = 0; i < kMaxVerticesPerUpdate; ++i)
    update.vertices.push_back({SubmapId{i}, kTime, {}, 0.0});
  update.edges.assign(kMaxEdgesPerUpdate, Update().edges[0]);
  const graph_update_t msg = ToLcm(update, kTime, 0);
  EXPECT_LT(msg.getEncodedSize(), 60'000);
  EXPECT_TRUE(FromLcm(msg));
}

TEST(ConvertGraphUpdate, RefusesEachDamage) {
  using M = graph_update_t;
  ExpectEachRefused<M>(
      ToLcm(Update(), kTime, 9),
      {{"version zero", [](M& m) { m.version = 0; }},
       {"kind unknown", [](M& m) { m.edges[0].kind = 3; }},
       {"kind negative", [](M& m) { m.edges[0].kind = -1; }},
       {"verdict unknown", [](M& m) { m.edges[0].verdict = 7; }},
       {"id negative", [](M& m) { m.edges[0].from_id = -1; }},
       {"vertex id negative", [](M& m) { m.vertices[0].id = -1; }},
       {"chain negative", [](M& m) { m.vertices[0].chain = -1; }},
       {"vertex NaN", [](M& m) { m.vertices[0].dead_reckoned_yaw_rad = kNan; }},
       {"heading sigma negative", [](M& m) { m.vertices[0].heading_sigma_rad = -1e-9; }},
       {"loop on itself", [](M& m) { m.edges[0].to_id = 1; }},
       {"fix on two", [](M& m) { m.edges[1].to_id = 1; }},
       {"pose NaN", [](M& m) { m.edges[0].x_m = kNan; }},
       {"information NaN", [](M& m) { m.edges[0].information[1][1] = kNan; }},
       {"information not symmetric", [](M& m) { m.edges[0].information[0][1] = 2.0; }},
       {"information negative", [](M& m) { m.edges[0].information[2][2] = -1.0; }},
       {"rms NaN", [](M& m) { m.edges[0].rms_m = kNan; }},
       {"overlap nowhere", [](M& m) { m.edges[0].overlap_center_y_m = kNan; }},
       {"sonar sigma negative", [](M& m) { m.sonar_sigma_m = -0.1; }},
       {"DVL sigma NaN", [](M& m) { m.dvl_yaw_sigma_rad = kNan; }},
       {"count above the list", [](M& m) { m.num_edges = 3; }},
       {"count negative", [](M& m) { m.num_vertices = -1; }}});
}

TEST(ConvertPoseGraph, ComesBackFromItsParts) {
  for (const auto& [vertices, edges] : {std::pair{0, 0}, {1, 0}, {251, 10}, {600, 1700}}) {
    const PoseGraph graph = Graph(vertices, edges);
    const std::vector<pose_graph_t> parts = ToLcm(graph, 8, kTime, 100);
    PoseGraphAssembler assembler;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_LT(parts[i].getEncodedSize(), 60'000);
      EXPECT_EQ(parts[i].seq, 100 + static_cast<int>(i));
      const auto whole = assembler.Add(Wire(parts[i]));
      ASSERT_EQ(whole.has_value(), i + 1 == parts.size());
      if (!whole) continue;
      EXPECT_EQ(whole->graph_version, 5);
      EXPECT_EQ(whole->graph_id, graph.graph_id);
      ASSERT_EQ(whole->mounting.size(), 1u);
      EXPECT_EQ(whole->MountingOf(0).Vector(), Eigen::Vector3d(0.3, -0.1, 0.002));
      EXPECT_EQ(whole->MountingOf(0).covariance, graph.MountingOf(0).covariance);
      ASSERT_EQ(whole->vertices.size(), graph.vertices.size());
      for (std::size_t k = 0; k < graph.vertices.size(); ++k) {
        EXPECT_EQ(whole->vertices[k].T_map_level.Vector(), graph.vertices[k].T_map_level.Vector());
        EXPECT_EQ(whole->vertices[k].covariance, graph.vertices[k].covariance);
        EXPECT_EQ(whole->vertices[k].covariance_with_newest,
                  graph.vertices[k].covariance_with_newest);
      }
      ASSERT_EQ(whole->loop_edges.size(), graph.loop_edges.size());
      for (std::size_t k = 0; k < graph.loop_edges.size(); ++k)
        EXPECT_EQ(whole->loop_edges[k].weight, graph.loop_edges[k].weight);
    }
    EXPECT_EQ(assembler.malformed(), 0);
  }
}

// Their errors come in parts, too.
TEST(ConvertPoseGraph, OfManyDivesComesBackFromItsParts) {
  PoseGraph graph = Graph(250, 500);
  graph.mounting.clear();
  for (int chain = 0; chain < 120; ++chain)
    graph.mounting[3 * chain] = {{0.01 * chain, -0.02}, 0.001, Eigen::Matrix3d::Identity()};
  const std::vector<pose_graph_t> parts = ToLcm(graph, 8, kTime, 100);
  ASSERT_EQ(parts.size(), 3u);
  PoseGraphAssembler assembler;
  EXPECT_LT(parts[0].getEncodedSize(), 60'000);
  EXPECT_FALSE(assembler.Add(Wire(parts[0])));
  EXPECT_FALSE(assembler.Add(Wire(parts[1])));
  const auto whole = assembler.Add(Wire(parts[2]));
  ASSERT_TRUE(whole);
  ASSERT_EQ(whole->mounting.size(), 120u);
  for (const auto& [chain, errors] : graph.mounting)
    EXPECT_EQ(whole->MountingOf(chain).Vector(), errors.Vector()) << chain;
  EXPECT_EQ(whole->MountingOf(1).Vector(), Eigen::Vector3d::Zero()) << "not estimated";
}

TEST(ConvertPoseGraph, WithAPartMissingIsNoGraphAndTheNextOneIs) {
  const auto parts = ToLcm(Graph(600, 0), 1, kTime, 0);
  ASSERT_EQ(parts.size(), 3u);
  PoseGraphAssembler assembler;
  EXPECT_FALSE(assembler.Add(parts[0]));
  EXPECT_FALSE(assembler.Add(parts[2]));
  EXPECT_EQ(assembler.malformed(), 1);
  EXPECT_FALSE(assembler.Add(parts[0]));
  const auto next = ToLcm(Graph(2, 1), 2, kTime, 3);
  EXPECT_TRUE(assembler.Add(next[0])) << "a newer solution ends the unfinished one";
  EXPECT_EQ(assembler.malformed(), 2);
}

TEST(ConvertPoseGraph, NeverMixesTwoSolutions) {
  const auto first = ToLcm(Graph(300, 0), 1, kTime, 0);
  const auto second = ToLcm(Graph(300, 0), 2, kTime, 2);
  PoseGraphAssembler assembler;
  EXPECT_FALSE(assembler.Add(first[0]));
  EXPECT_FALSE(assembler.Add(second[1]));
  EXPECT_EQ(assembler.malformed(), 1);
}

TEST(ConvertPoseGraph, RefusesEachDamage) {
  const std::vector<Damage<pose_graph_t>> damages{
      {"ids not rising", [](pose_graph_t& m) { m.vertices[1].id = 0; }},
      {"id negative", [](pose_graph_t& m) { m.vertices[0].id = -1; }},
      {"pose NaN", [](pose_graph_t& m) { m.vertices[0].yaw_rad = kNan; }},
      {"covariance negative", [](pose_graph_t& m) { m.vertices[0].covariance[0][0] = -1; }},
      {"cross NaN", [](pose_graph_t& m) { m.vertices[0].covariance_with_newest[2][2] = kNan; }},
      {"weight above one", [](pose_graph_t& m) { m.loop_edges[0].weight = 1.1; }},
      {"weight NaN", [](pose_graph_t& m) { m.loop_edges[0].weight = kNan; }},
      {"sonar nowhere", [](pose_graph_t& m) { m.mountings[0].sonar_forward_m = kNan; }},
      {"DVL turned by NaN", [](pose_graph_t& m) { m.mountings[0].dvl_yaw_rad = kNan; }},
      {"covariance of mounting not symmetric",
       [](pose_graph_t& m) { m.mountings[0].covariance[0][1] = 1.0; }},
      {"mounting of no dive", [](pose_graph_t& m) { m.mountings[0].chain = -1; }},
      {"mounting of one dive twice",
       [](pose_graph_t& m) {
         m.mountings.push_back(m.mountings[0]);
         m.num_mountings = 2;
       }},
      {"no parts", [](pose_graph_t& m) { m.num_parts = 0; }},
      {"endless parts", [](pose_graph_t& m) { m.num_parts = 1 << 30; }},
      {"part negative", [](pose_graph_t& m) { m.part = -1; }}};
  for (const auto& damage : damages) {
    pose_graph_t msg = ToLcm(Graph(2, 1), 0, kTime, 0)[0];
    damage.apply(msg);
    PoseGraphAssembler assembler;
    EXPECT_FALSE(assembler.Add(msg)) << damage.name;
    EXPECT_EQ(assembler.malformed(), 1) << damage.name;
  }
}

TEST(ConvertCovariances, RequestAndAnswerComeBack) {
  for (const int pairs : {0, 1, kMaxCovariancePairs}) {
    const covariance_request_t asked = ToLcm(Request(pairs), kTime);
    EXPECT_EQ(asked.seq, 3);
    EXPECT_EQ(asked.utime, ToUtime(kTime));
    const auto request = FromLcm(Wire(asked));
    ASSERT_TRUE(request);
    EXPECT_EQ(request->sender, "mapper");
    EXPECT_EQ(request->seq, 3);
    EXPECT_EQ(request->graph_version, 7);
    EXPECT_EQ(request->graph_id, Request(0).graph_id);
    EXPECT_EQ(request->pairs, Request(pairs).pairs);

    const covariances_t answered = ToLcm(Answer(pairs), kTime, 3);
    EXPECT_LT(answered.getEncodedSize(), 60'000);
    const auto answer = FromLcm(Wire(answered));
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->recipient, "mapper");
    EXPECT_EQ(answer->request_seq, 3);
    EXPECT_EQ(answer->graph_version, 7);
    EXPECT_EQ(answer->graph_id, Answer(0).graph_id);
    ASSERT_EQ(answer->pairs.size(), static_cast<std::size_t>(pairs));
    for (int k = 0; k < pairs; ++k) {
      const PairCovariance& pair = answer->pairs[static_cast<std::size_t>(k)];
      EXPECT_EQ(pair.b, SubmapId{2 * k + 1});
      EXPECT_EQ(pair.covariance, Answer(pairs).pairs[static_cast<std::size_t>(k)].covariance);
    }
  }
}

TEST(ConvertCovariances, RefuseEachDamage) {
  using Request_t = covariance_request_t;
  ExpectEachRefused<Request_t>(
      ToLcm(Request(2), kTime),
      {{"no version", [](Request_t& m) { m.graph_version = 0; }},
       {"time", [](Request_t& m) { m.utime = -1; }},
       {"count above the lists", [](Request_t& m) { m.num_pairs = 3; }},
       {"count negative", [](Request_t& m) { m.num_pairs = -1; }},
       {"lists of two lengths", [](Request_t& m) { m.b_id.pop_back(); }},
       {"a name without end", [](Request_t& m) { m.sender = std::string(65, 'x'); }},
       {"too many", [](Request_t& m) {
          m.num_pairs = kMaxCovariancePairs + 1;
          m.a_id.resize(kMaxCovariancePairs + 1);
          m.b_id.resize(kMaxCovariancePairs + 1);
        }}});
  using Answer_t = covariances_t;
  ExpectEachRefused<Answer_t>(
      ToLcm(Answer(2), kTime, 0),
      {{"no version", [](Answer_t& m) { m.graph_version = 0; }},
       {"time", [](Answer_t& m) { m.utime = -1; }},
       {"id negative", [](Answer_t& m) { m.pairs[1].a_id = -1; }},
       {"variance negative", [](Answer_t& m) { m.pairs[0].covariance[1][1] = -1.0; }},
       {"not symmetric", [](Answer_t& m) { m.pairs[0].covariance[0][1] = 0.5; }},
       {"NaN", [](Answer_t& m) { m.pairs[1].covariance[2][2] = kNan; }},
       {"count above the list", [](Answer_t& m) { m.num_pairs = 3; }},
       {"count negative", [](Answer_t& m) { m.num_pairs = -1; }},
       {"a name without end", [](Answer_t& m) { m.recipient = std::string(65, 'x'); }},
       {"too many", [](Answer_t& m) {
          m.num_pairs = kMaxCovariancePairs + 1;
          m.pairs.resize(kMaxCovariancePairs + 1, m.pairs[0]);
        }}});
}

TEST(ConvertConfig, ComesBackFromItsParts) {
  for (const std::size_t size : {0u, 1u, 50'000u, 50'001u, 170'000u}) {
    ConfigText file = Config();
    file.text.assign(size, 'x');
    const std::vector<config_t> parts = ToLcm(file, kTime, 10);
    ConfigAssembler assembler;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_LT(parts[i].getEncodedSize(), kMaxMessageBytes);
      EXPECT_EQ(parts[i].seq, 10 + static_cast<int>(i));
      const auto whole = assembler.Add(Wire(parts[i]));
      ASSERT_EQ(whole.has_value(), i + 1 == parts.size());
      if (whole) {
        EXPECT_EQ(*whole, file);
      }
    }
    EXPECT_EQ(assembler.malformed(), 0);
  }
}

TEST(ConvertConfig, OfSeveralProcessesMayCross) {
  ConfigText mapper = Config();
  ConfigText logger = Config();
  mapper.text.assign(60'000, 'm');
  logger.text.assign(60'000, 'l');
  logger.process = "logger";
  const auto a = ToLcm(mapper, kTime, 0);
  const auto b = ToLcm(logger, kTime, 0);
  ConfigAssembler assembler;
  EXPECT_FALSE(assembler.Add(a[0]));
  EXPECT_FALSE(assembler.Add(b[0]));
  EXPECT_EQ(assembler.Add(a[1]), mapper);
  EXPECT_EQ(assembler.Add(b[1]), logger);
  EXPECT_EQ(assembler.malformed(), 0);
}

TEST(ConvertConfig, WithAPartMissingIsNoFileAndTheNextOneIs) {
  ConfigText file = Config();
  file.text.assign(120'000, 'x');
  const auto parts = ToLcm(file, kTime, 0);
  ASSERT_EQ(parts.size(), 3u);
  ConfigAssembler assembler;
  EXPECT_FALSE(assembler.Add(parts[0]));
  EXPECT_FALSE(assembler.Add(parts[2]));
  EXPECT_EQ(assembler.malformed(), 1);
  EXPECT_EQ(assembler.Add(ToLcm(Config(), kTime, 0)[0]), Config());
  EXPECT_EQ(assembler.malformed(), 1);
}

TEST(ConvertConfig, RefusesEachDamage) {
  using M = config_t;
  for (const Damage<M>& damage : std::vector<Damage<M>>{
           {"time", [](M& m) { m.utime = -1; }},
           {"of nobody", [](M& m) { m.process = ""; }},
           {"a name without end", [](M& m) { m.process = std::string(65, 'x'); }},
           {"a file name without end", [](M& m) { m.name = std::string(257, 'x'); }},
           {"part negative", [](M& m) { m.part = -1; }},
           {"no parts", [](M& m) { m.num_parts = 0; }},
           {"endless parts", [](M& m) { m.num_parts = 1 << 30; }},
           {"text too long", [](M& m) { m.text.assign(50'001, 'x'); }}}) {
    config_t msg = ToLcm(Config(), kTime, 0)[0];
    damage.apply(msg);
    ConfigAssembler assembler;
    EXPECT_FALSE(assembler.Add(msg)) << damage.name;
    EXPECT_EQ(assembler.malformed(), 1) << damage.name;
  }
}

TEST(ConvertConfig, IsBoundedWhateverProcessesThereAre) {
  ConfigAssembler assembler;
  config_t msg = ToLcm(Config(), kTime, 0)[0];
  msg.num_parts = 2;
  for (int i = 0; i < 1'000; ++i) {
    msg.process = "p" + std::to_string(i);
    assembler.Add(msg);
  }
  EXPECT_GT(assembler.malformed(), 900);
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
