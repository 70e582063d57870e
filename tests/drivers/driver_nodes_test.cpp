#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/kongsberg/kmall_stream.hpp"
#include "common/convert/convert.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000;

ImuSample Imu(int i) {
  ImuSample sample;
  sample.time = FromUtime(kStart + 10'000 * i);
  sample.angular_rate_radps = {0.001 * i, 0.0, 0.0};
  sample.specific_force_mps2 = {0.0, 0.0, -9.81};
  sample.attitude.emplace().sigma_rpy_rad = {0.001, 0.001, 0.01};
  return sample;
}

// What a bus carries on one channel.
template <class Msg>
class Recorder {
 public:
  Recorder(Bus* bus, const std::string& channel) {
    bus->Subscribe<Msg>(channel, 0, [this](const Msg& msg) { messages.push_back(msg); });
  }
  std::vector<Msg> messages;
};

class DriverNodes : public testing::Test {
 protected:
  Bus bus{"memq://"};
  BusOutput output{&bus};
  Recorder<raw_bytes_t> raw_can{&bus, "RAW_CAN"};
  Recorder<raw_bytes_t> raw_mbes{&bus, "RAW_MBES"};
  Recorder<imu_t> imu{&bus, "IMU"};
  Recorder<dvl_t> dvl{&bus, "DVL"};
  Recorder<depth_t> depth{&bus, "DEPTH"};
  Recorder<mbes_ping_t> pings{&bus, "MBES_PING"};
  Recorder<sound_velocity_profile_t> profiles{&bus, "SVP"};
};

TEST_F(DriverNodes, ImuFramesBecomeImuAndRawCan) {
  const ImuDriverConfig config = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  ImuDriver driver(config, &output);
  ImuCanEncoder encoder(config.can.signals, FromUtime(kStart - 1'000'000));
  std::vector<CanFrame> sent;
  for (int i = 0; i < 30; ++i) {
    std::vector<ReceivedFrame> batch;
    for (const CanFrame& frame : encoder.Encode(Imu(i))) {
      batch.push_back({frame, Imu(i).time + Duration(3000)});
      sent.push_back(frame);
    }
    driver.Feed(batch);
  }
  bus.HandleAll();

  ASSERT_EQ(imu.messages.size(), 30u);
  for (std::size_t i = 0; i < 30; ++i) {
    const imu_t& msg = imu.messages[i];
    EXPECT_EQ(msg.seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(msg.utime, kStart + 10'000 * static_cast<std::int64_t>(i));
    EXPECT_EQ(msg.recv_utime, msg.utime + 3000);
    EXPECT_TRUE(FromLcm(msg));
  }
  // RAW_CAN gives back every frame.
  std::vector<CanFrame> recorded;
  for (std::size_t i = 0; i < raw_can.messages.size(); ++i) {
    EXPECT_EQ(raw_can.messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(raw_can.messages[i].source, "can:can0#imu-driver");
    const auto packet = DecodeCannelloni(raw_can.messages[i].data);
    ASSERT_TRUE(packet);
    recorded.insert(recorded.end(), packet->frames.begin(), packet->frames.end());
  }
  EXPECT_EQ(raw_can.messages.size(), 30u);
  EXPECT_EQ(recorded, sent);
}

TEST_F(DriverNodes, RawCanSpansNoMoreThanAMillisecond) {
  const ImuDriverConfig config = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  ImuDriver driver(config, &output);
  std::vector<ReceivedFrame> batch;
  for (int i = 0; i < 10; ++i) batch.push_back({CanFrame{}, FromUtime(kStart + 400 * i)});
  driver.Feed(batch);
  bus.HandleAll();
  std::size_t frames = 0;
  for (const raw_bytes_t& msg : raw_can.messages) {
    frames += DecodeCannelloni(msg.data)->frames.size();
    EXPECT_EQ(msg.recv_utime, kStart + 400 * static_cast<std::int64_t>(frames - 1));
  }
  EXPECT_EQ(frames, 10u);
  EXPECT_EQ(raw_can.messages.size(), 4u);
}

TEST_F(DriverNodes, DvlFramesBecomeDvlAndDepth) {
  const DvlDriverConfig config = LoadDvlDriverConfig(ConfigFile("dvl_driver.yaml"));
  DvlDriver driver(config, &output);
  const DvlCanEncoder encoder(config.can.signals);
  for (int i = 0; i < 5; ++i) {
    DvlSample sample;
    sample.time = FromUtime(kStart + 200'000 * i);
    sample.bottom_lock = i != 3;
    sample.v_dvl_mps = {1.5, 0.0, 0.0};
    sample.sigma_v_mps = {0.003, 0.003, 0.003};
    DepthSample at;
    at.time = sample.time;
    at.depth_m = 20.0;
    at.sigma_m = 0.02;
    for (const CanFrame& frame : encoder.Encode(sample, at))
      driver.Feed(frame, sample.time + Duration(100'000));
  }
  bus.HandleAll();
  ASSERT_EQ(dvl.messages.size(), 5u);
  ASSERT_EQ(depth.messages.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(dvl.messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(depth.messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(dvl.messages[i].bottom_lock, i != 3);
    EXPECT_TRUE(FromLcm(dvl.messages[i])) << i;
    EXPECT_TRUE(FromLcm(depth.messages[i])) << i;
  }
}

TEST_F(DriverNodes, ErrorFramesAreCountedAndKept) {
  ImuDriver driver(LoadImuDriverConfig(ConfigFile("imu_driver.yaml")), &output);
  CanFrame error;
  error.error = true;
  error.id = 0x44;
  error.length = 8;
  driver.Feed(error, FromUtime(kStart));
  driver.UpdateHealth({}, {});
  EXPECT_EQ(driver.health().counter("can_error_frames"), 1);
  EXPECT_EQ(driver.health().counter("can_bus_off"), 1);
  bus.HandleAll();
  EXPECT_EQ(raw_can.messages.size(), 1u);
}

TEST_F(DriverNodes, TroubleOnTheWireDegradesWhileDataStillCome) {
  ImuDriver driver(LoadImuDriverConfig(ConfigFile("imu_driver.yaml")), &output);
  ImuCanEncoder encoder(LoadImuDriverConfig(ConfigFile("imu_driver.yaml")).can.signals,
                        FromUtime(kStart - 1'000'000));
  DeviceWatch::Clock::time_point now{};
  const auto feed = [&](int i) {
    for (const CanFrame& frame : encoder.Encode(Imu(i))) driver.Feed(frame, Imu(i).time);
    driver.UpdateHealth({}, now += std::chrono::seconds(1));
  };
  feed(0);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
  CanFrame error;
  error.error = true;
  error.id = 0x004;
  error.length = 8;
  error.bytes[1] = 0x10;  // receive counter above 127
  driver.Feed(error, Imu(1).time);
  feed(1);
  EXPECT_EQ(driver.health().state(), HealthState::kDegraded);
  EXPECT_THAT(driver.health().text(), testing::HasSubstr("error-passive"));
  error.bytes[1] = 0x40;  // error-active again
  driver.Feed(error, Imu(2).time);
  feed(2);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

TEST_F(DriverNodes, AControllerThatWasDownIsErrorPassiveNoMore) {
  ImuDriver driver(LoadImuDriverConfig(ConfigFile("imu_driver.yaml")), &output);
  CanFrame passive;
  passive.error = true;
  passive.id = 0x004;
  passive.length = 8;
  passive.bytes[1] = 0x10;
  driver.Feed(passive, Imu(0).time);
  driver.UpdateHealth({}, {});
  EXPECT_THAT(driver.health().text(), testing::HasSubstr("error-passive"));
  driver.SeeOutages(1);
  driver.UpdateHealth({}, {});
  EXPECT_THAT(driver.health().text(), testing::Not(testing::HasSubstr("error-passive")));
  driver.Feed(passive, Imu(1).time);
  driver.SeeOutages(1);
  driver.UpdateHealth({}, {});
  EXPECT_THAT(driver.health().text(), testing::HasSubstr("error-passive"));
}

TEST_F(DriverNodes, TheReasonOfASilenceIsSaid) {
  DvlDriver driver(LoadDvlDriverConfig(ConfigFile("dvl_driver.yaml")), &output);
  const DeviceWatch::Clock::time_point t0{};
  driver.UpdateHealth({}, t0, "no such interface");
  EXPECT_EQ(driver.health().state(), HealthState::kDegraded);
  EXPECT_EQ(driver.health().text(),
            "the device's interface or port cannot be used: no such interface; waiting for "
            "can:can0");
  driver.UpdateHealth({}, t0 + std::chrono::seconds(6), "no such interface");
  EXPECT_EQ(driver.health().state(), HealthState::kLost);
  EXPECT_EQ(
      driver.health().text(),
      "no usable data from the device: for 6 s; the device's interface or port cannot be used: "
      "no such interface; can:can0");
}

TEST_F(DriverNodes, HealthIsLostAfterSilenceAndOkAgainByItself) {
  using std::chrono::seconds;
  ImuDriverConfig config = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  config.driver.timeout_s = 3.0;
  ImuDriver driver(config, &output);
  ImuCanEncoder encoder(config.can.signals, FromUtime(kStart - 1'000'000));
  const DeviceWatch::Clock::time_point t0{};
  const auto feed = [&](int i) {
    for (const CanFrame& frame : encoder.Encode(Imu(i))) driver.Feed(frame, Imu(i).time);
  };
  driver.UpdateHealth({}, t0);
  driver.UpdateHealth({}, t0 + seconds(2));
  EXPECT_EQ(driver.health().state(), HealthState::kStarting);
  driver.UpdateHealth({}, t0 + seconds(3));
  EXPECT_EQ(driver.health().state(), HealthState::kLost);
  feed(0);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
  driver.UpdateHealth({}, t0 + seconds(4));
  driver.UpdateHealth({}, t0 + seconds(6));
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
  // Frames that say nothing do not keep it alive.
  driver.Feed(CanFrame{}, FromUtime(kStart));
  driver.UpdateHealth({}, t0 + seconds(7));
  EXPECT_EQ(driver.health().state(), HealthState::kLost);
  EXPECT_THAT(driver.health().text(),
              testing::HasSubstr("no usable data from the device: for 3 s"));
  feed(1);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

TEST_F(DriverNodes, MbesDatagramsBecomePingsProfilesAndRaw) {
  MbesDriver driver(LoadMbesDriverConfig(ConfigFile("mbes_driver.yaml")), &output);
  MbesPing ping;
  ping.time = FromUtime(kStart);
  ping.sound_speed_mps = 1500.0;
  ping.beams.resize(700);
  for (MbesBeam& beam : ping.beams) {
    beam.twtt_s = 0.05f;
    beam.flags = kBeamValid | kBeamPhase;
  }
  SoundVelocityProfile profile;
  profile.time = FromUtime(kStart);
  profile.depth_m = {0.0, 10.0};
  profile.speed_mps = {1500.0, 1495.0};
  std::vector<std::uint8_t> sent;
  const auto feed = [&](const std::vector<std::uint8_t>& bytes) {
    driver.Feed({bytes, FromUtime(kStart + 90'000), 7});
    sent.insert(sent.end(), bytes.begin(), bytes.end());
  };
  feed(EncodeSvp(profile, KmallHeader{}));
  for (const auto& part : SplitIntoParts(EncodeMrz(ping, KmallHeader{}))) feed(part);
  bus.HandleAll();
  ASSERT_EQ(pings.messages.size(), 1u);
  ASSERT_EQ(profiles.messages.size(), 1u);
  EXPECT_EQ(pings.messages[0].num_beams, 700);
  EXPECT_EQ(pings.messages[0].recv_utime, kStart + 90'000);
  EXPECT_TRUE(FromLcm(pings.messages[0]));
  EXPECT_TRUE(FromLcm(profiles.messages[0]));
  // RAW_MBES: a part of 64 kB comes in two messages; together they are what was sent.
  std::vector<std::uint8_t> recorded;
  for (std::size_t i = 0; i < raw_mbes.messages.size(); ++i) {
    EXPECT_EQ(raw_mbes.messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_LE(raw_mbes.messages[i].size, kMaxRawBytesPerPart);
    recorded.insert(
        recorded.end(), raw_mbes.messages[i].data.begin(), raw_mbes.messages[i].data.end());
  }
  EXPECT_EQ(recorded, sent);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

TEST_F(DriverNodes, BadDatagramsAreKeptAndCounted) {
  MbesDriver driver(LoadMbesDriverConfig(ConfigFile("mbes_driver.yaml")), &output);
  driver.Feed({{1, 2, 3}, FromUtime(kStart), 7});
  driver.Feed({{}, FromUtime(kStart), 7});
  driver.UpdateHealth({{"udp_dropped", 4}}, {});
  EXPECT_EQ(driver.health().counter("kmall_malformed"), 2);
  EXPECT_EQ(driver.health().counter("udp_dropped"), 4);
  bus.HandleAll();
  EXPECT_TRUE(pings.messages.empty());
  ASSERT_FALSE(raw_mbes.messages.empty());
  EXPECT_EQ(raw_mbes.messages[0].data, (std::vector<std::uint8_t>{1, 2, 3}));
}

// A sonar whose network cuts, damages, repeats and shuffles, beside another instrument on its port.
TEST_F(DriverNodes, EveryDatagramThatGivesNoPingIsCountedWithItsCause) {
  MbesDriver driver(LoadMbesDriverConfig(ConfigFile("mbes_driver.yaml")), &output);
  MbesPing ping;
  ping.sound_speed_mps = 1500.0;
  ping.beams.resize(100);
  for (MbesBeam& beam : ping.beams) {
    beam.twtt_s = 0.05f;
    beam.flags = kBeamValid | kBeamPhase;
  }
  int number = 0;
  const auto parts_of_next = [&] {
    ping.time = FromUtime(kStart + 100'000 * ++number);
    ping.ping_number = static_cast<std::uint32_t>(number);
    return SplitIntoParts(EncodeMrz(ping, KmallHeader{}), 5000);
  };
  const auto feed = [&](const std::vector<std::uint8_t>& bytes) {
    driver.Feed({bytes, ping.time + Duration(90'000), 7});
  };
  const auto good = [&] {
    for (const auto& part : parts_of_next()) feed(part);
  };
  good();
  std::vector<std::vector<std::uint8_t>> parts = parts_of_next();
  ASSERT_GE(parts.size(), 3u);
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) feed(*part);  // last first
  parts = parts_of_next();
  feed(parts[0]);
  for (const auto& part : parts) feed(part);  // the first twice
  parts = parts_of_next();
  parts[1].resize(parts[1].size() / 2);
  for (const auto& part : parts) feed(part);  // one cut
  parts = parts_of_next();
  parts[1][0] ^= 0x40;
  for (const auto& part : parts) feed(part);  // the length of one damaged
  parts = parts_of_next();
  parts.erase(parts.begin() + 1);
  for (const auto& part : parts) feed(part);  // one never came
  feed({'B', 'T', 'H', '0', 0, 0, 0, 16});    // an R2Sonic on the same port
  feed(std::vector<std::uint8_t>(64, 0));
  for (int i = 0; i < 30; ++i) good();
  driver.UpdateHealth({}, {});
  bus.HandleAll();

  EXPECT_EQ(pings.messages.size(), 33u);
  for (std::size_t i = 1; i < pings.messages.size(); ++i) {
    EXPECT_EQ(pings.messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_GT(pings.messages[i].utime, pings.messages[i - 1].utime);
  }
  const Health& health = driver.health();
  EXPECT_EQ(health.counter("mbes_datagram_repeated"), 1);
  EXPECT_EQ(health.counter("kmall_malformed"), 4);  // cut, damaged, two foreign
  EXPECT_EQ(health.counter("kmall_set_incomplete"), 3);
  EXPECT_EQ(health.state(), HealthState::kOk);
}

TEST_F(DriverNodes, ASonarThatFallsSilentIsLostAndOkAgainByItself) {
  using std::chrono::seconds;
  MbesDriver driver(LoadMbesDriverConfig(ConfigFile("mbes_driver.yaml")), &output);
  const DeviceWatch::Clock::time_point t0{};
  const auto feed = [&](int i) {
    MbesPing ping;
    ping.time = FromUtime(kStart + 1'000'000 * i);
    ping.sound_speed_mps = 1500.0;
    ping.beams.resize(1);
    ping.beams[0].twtt_s = 0.05f;
    driver.Feed({EncodeMrz(ping, KmallHeader{}), ping.time, 7});
  };
  feed(0);
  driver.UpdateHealth({}, t0);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
  driver.Feed({{1, 2, 3}, FromUtime(kStart), 7});  // bytes, but no ping
  driver.UpdateHealth({}, t0 + seconds(5));
  EXPECT_EQ(driver.health().state(), HealthState::kLost);
  feed(6);
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

}  // namespace
}  // namespace seastitch
