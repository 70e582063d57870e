// The drivers as people start them: real processes, real sockets, real LCM.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/kongsberg/kmall_stream.hpp"
#include "codecs/makers/wbms.hpp"
#include "common/runtime/bus.hpp"
#include "drivers/dvl/dvl_nmea2000.hpp"
#include "drivers/dvl/pd0.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/udp_socket.hpp"
#include "seastitch/config_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/drivers/loopback.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

void ExpectOneLineAndFailure(Process* process, const std::string& part, int exit_code) {
  EXPECT_EQ(process->Wait(), exit_code);
  const std::string output = process->Output();
  EXPECT_THAT(output, HasSubstr(part));
  EXPECT_EQ(output.find('\n'), output.size() - 1) << output;
}

TEST_F(DriverProcess, WrongConfigurationsEndWithOneLine) {
  const std::string misspelt = dir.Write("bad.yaml", "source: can:can0\nsauce: 1\ndbc: x.dbc\n");
  for (const std::string name :
       {"seastitch-imu-driver", "seastitch-dvl-driver", "seastitch-mbes-driver"}) {
    ExpectOneLineAndFailure(
        Start(name, "/nowhere.yaml").get(), name + ": /nowhere.yaml: ", EX_CONFIG);
    ExpectOneLineAndFailure(Start(name, misspelt).get(), name + ": " + misspelt + ": ", EX_CONFIG);
  }
}

TEST_F(DriverProcess, AFileThatIsMissingEndsItWithOneLine) {
  const auto dvl = WithSource(dir, "dvl_driver.yaml", "candump:/nowhere.log");
  ExpectOneLineAndFailure(
      Start("seastitch-dvl-driver", dvl).get(), "source: candump:/nowhere.log: ", EX_CONFIG);
}

TEST_F(DriverProcess, ABusyPortIsSaidWaitedForAndTaken) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  const int port = FreeUdpPort();
  const std::string busy = "udp:127.0.0.1:" + std::to_string(port);
  auto occupant = std::make_unique<UdpSocket>(busy, 65536);
  std::string text;
  std::size_t raw = 0;
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { text = m.text; });
  bus->Subscribe<raw_bytes_t>("RAW_MBES", 0, [&](const raw_bytes_t&) { ++raw; });
  const auto process = Start("seastitch-mbes-driver", WithSource(dir, "mbes_driver.yaml", busy));
  ASSERT_TRUE(HandleUntil([&] { return !text.empty(); }, 10'000)) << process->Output();
  EXPECT_THAT(text, HasSubstr("Address already in use"));
  occupant.reset();
  ASSERT_TRUE(HandleUntil([&] { return text.find("in use") == std::string::npos; }, 10'000));
  UdpSender(port).Send({1, 2, 3});
  EXPECT_TRUE(HandleUntil([&] { return raw == 1; }, 10'000));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// Another computer of the network sends to the sonar's port.
TEST_F(DriverProcess, AnotherSenderIsRefusedAndNamedUntilTheSonarIsSilent) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  const int port = FreeUdpPort();
  health_t health{};
  std::vector<std::uint8_t> taken;
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { health = m; });
  bus->Subscribe<raw_bytes_t>("RAW_MBES", 0, [&](const raw_bytes_t& m) { taken = m.data; });
  const auto process =
      Start("seastitch-mbes-driver",
            WithSource(dir, "mbes_driver.yaml", "udp:127.0.0.1:" + std::to_string(port)));
  ASSERT_TRUE(HandleUntil([&] { return !health.text.empty(); }, 10'000)) << process->Output();
  const UdpSender sonar(port, "127.0.0.1", "127.0.0.5"), other(port, "127.0.0.1", "127.0.0.6");
  const std::vector<std::uint8_t> junk = {1, 2, 3};
  SoundVelocityProfile profile;
  profile.time = FromUtime(NowUtime());
  profile.depth_m = {0.0, 100.0};
  profile.speed_mps = {1500.0, 1490.0};
  const std::vector<std::uint8_t> of_sonar = EncodeSvp(profile, KmallHeader{});
  // Junk that comes first keeps nobody out.
  other.Send(junk);
  ASSERT_TRUE(HandleUntil([&] { return taken == junk; }, 10'000));
  sonar.Send(of_sonar);
  ASSERT_TRUE(HandleUntil([&] { return taken == of_sonar; }, 10'000));
  other.Send(junk);
  const std::string sentence =
      "datagrams come from another sender, and are refused: 1 so far, the last of 127.0.0.6, while "
      "127.0.0.5 sends";
  EXPECT_TRUE(HandleUntil([&] { return health.text.find(sentence) != std::string::npos; }, 10'000))
      << health.text;
  EXPECT_EQ(taken, of_sonar);
  // The sonar was replaced: the other one is taken once the first is silent for 5 s.
  profile.time += std::chrono::seconds(10);
  const std::vector<std::uint8_t> of_other = EncodeSvp(profile, KmallHeader{});
  EXPECT_TRUE(HandleUntil(
      [&] {
        other.Send(of_other);
        return taken == of_other;
      },
      20'000));
  EXPECT_TRUE(
      HandleUntil([&] { return health.text.find("another sender") == std::string::npos; }, 30'000))
      << health.text;
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// A gateway of CAN frames, named in the source, and a forger who was there first.
TEST_F(DriverProcess, OnlyTheGatewayThatIsNamedMovesTheVehicle) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  const int port = FreeUdpPort();
  const std::string url = "udp:127.0.0.1:" + std::to_string(port) + "?from=127.0.0.5";
  const std::string file = WithSource(dir, "imu_driver.yaml", url);
  const ImuDriverConfig config = LoadImuDriverConfig(file);
  std::map<std::int64_t, int> messages;  // by time
  std::string text;
  bus->Subscribe<imu_t>("IMU", 0, [&](const imu_t& m) { ++messages[m.utime]; });
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { text = m.text; });
  const auto process = Start("seastitch-imu-driver", file);
  ASSERT_TRUE(HandleUntil([&] { return !text.empty(); }, 10'000)) << process->Output();
  const UdpSender gateway(port, "127.0.0.1", "127.0.0.5"), forger(port, "127.0.0.1", "127.0.0.6");
  constexpr std::int64_t kStart = 1'700'000'000'000'000;
  ImuCanEncoder device(config.can.signals, FromUtime(kStart));
  ImuCanEncoder forged(config.can.signals, FromUtime(kStart));
  const auto packet = [](ImuCanEncoder* encoder, std::int64_t utime) {
    ImuSample sample;
    sample.time = FromUtime(utime);
    sample.attitude.emplace();
    return EncodeCannelloni(encoder->Encode(sample), 0);
  };
  for (int i = 1; i <= 10; ++i) {
    forger.Send(packet(&forged, kStart + 20'000 * i + 10'000));
    gateway.Send(packet(&device, kStart + 20'000 * i));
  }
  EXPECT_TRUE(HandleUntil([&] { return messages.size() >= 10; }, 10'000)) << process->Output();
  EXPECT_TRUE(HandleUntil(
      [&] { return text.find("10 so far, the last of 127.0.0.6, which is") != std::string::npos; },
      10'000))
      << text;
  ASSERT_EQ(messages.size(), 10u);
  for (int i = 1; i <= 10; ++i) EXPECT_EQ(messages[kStart + 20'000 * i], 1) << i;
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

TEST_F(DriverProcess, PublishesItsConfigurationAtTheStart) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  std::optional<config_t> got;
  bus->Subscribe<config_t>("CONFIG", 0, [&](const config_t& m) { got = m; });
  const std::string file =
      WithSource(dir, "mbes_driver.yaml", "udp:127.0.0.1:" + std::to_string(FreeUdpPort()));
  const auto process = Start("seastitch-mbes-driver", file);
  ASSERT_TRUE(HandleUntil([&] { return got.has_value(); }, 10'000)) << process->Output();
  EXPECT_EQ(got->process, "mbes-driver");
  EXPECT_EQ(got->name, "mbes_driver.yaml");
  EXPECT_EQ(got->text, PrintConfig(LoadMbesDriverConfig(file)));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

TEST_F(DriverProcess, ShippedConfigurationsCanBeUsed) {
  for (const std::string device : {"imu", "dvl", "mbes"}) {
    Process process(Program("seastitch-" + device + "-driver"),
                    {"--config", ConfigFile(device + "_driver.yaml"), "--check-config"},
                    (dir.path() / "out.txt").string());
    EXPECT_EQ(process.Wait(), EXIT_SUCCESS) << process.Output();
  }
}

TEST_F(DriverProcess, ACandumpLogIsPublishedWholeThenTheProcessEnds) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  const ImuDriverConfig shipped = LoadImuDriverConfig(ConfigFile("imu_driver.yaml"));
  ImuCanEncoder encoder(shipped.can.signals, FromUtime(1'700'000'000'000'000));
  std::string log;
  for (int i = 0; i < 200; ++i) {
    ImuSample sample;
    sample.time = FromUtime(1'700'000'010'000'000 + 10'000 * i);
    sample.attitude.emplace();
    for (const CanFrame& frame : encoder.Encode(sample))
      log += FormatCandumpLine({sample.time, "can0", frame}) + "\n";
  }
  const std::string file = dir.Write("imu.log", log);
  std::vector<imu_t> messages;
  bus->Subscribe<imu_t>("IMU", 0, [&](const imu_t& msg) { messages.push_back(msg); });
  const auto process = Start("seastitch-imu-driver",
                             WithSource(dir, "imu_driver.yaml", "candump:" + file + "?speed=4"));
  HandleUntil([&] { return messages.size() == 200; }, 20'000);
  EXPECT_EQ(process->Wait(), EXIT_SUCCESS) << process->Output();
  ASSERT_EQ(messages.size(), 200u);
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(messages[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(messages[i].utime, 1'700'000'010'000'000 + 10'000 * static_cast<std::int64_t>(i));
  }
}

DvlSample Velocity(int i) {
  DvlSample sample;
  sample.time = FromUtime(1'700'000'000'000'000 + 200'000 * i);
  sample.bottom_lock = true;
  sample.v_dvl_mps = {1.0 + 0.1 * i, -0.2, 0.0};
  for (DvlBeam& beam : sample.beams) beam = {true, 20.0, 0.0};
  sample.altitude_m = 20.0;
  return sample;
}

// A Doppler log over UDP through the real process: datagrams in, DVL and the bytes out.
class DopplerLogOverUdp : public DriverProcess {
 protected:
  void Run(const std::string& config,
           const std::string& raw_channel,
           const std::vector<std::vector<std::uint8_t>>& datagrams) {
    std::size_t raw_messages = 0;
    bool listens = false;
    bus->Subscribe<dvl_t>("DVL", 0, [this](const dvl_t& m) { messages.push_back(m); });
    bus->Subscribe<raw_bytes_t>(raw_channel, 0, [&](const raw_bytes_t&) { ++raw_messages; });
    bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t&) { listens = true; });
    const int port = FreeUdpPort();
    const auto process = Start("seastitch-dvl-driver",
                               WithSource(dir, config, "udp:127.0.0.1:" + std::to_string(port)));
    ASSERT_TRUE(HandleUntil([&] { return listens; }, 10'000)) << process->Output();
    UdpSender sender(port);
    for (const std::vector<std::uint8_t>& datagram : datagrams) sender.Send(datagram);
    EXPECT_TRUE(HandleUntil([&] { return messages.size() == datagrams.size(); }, 10'000));
    EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
    EXPECT_GE(raw_messages, 1u);
  }
  void ExpectVelocities(double altitude_m) const {
    for (std::size_t i = 0; i < messages.size(); ++i) {
      EXPECT_EQ(messages[i].seq, static_cast<std::int64_t>(i));
      EXPECT_TRUE(messages[i].bottom_lock);
      EXPECT_NEAR(messages[i].v_dvl_mps[0], 1.0 + 0.1 * static_cast<double>(i), 0.001);
      EXPECT_NEAR(messages[i].v_dvl_mps[1], -0.2, 0.001);
      EXPECT_NEAR(messages[i].altitude_m, altitude_m, 0.01);
    }
  }
  std::vector<dvl_t> messages;
};

TEST_F(DopplerLogOverUdp, Pd0EnsemblesArrive) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  std::vector<std::vector<std::uint8_t>> datagrams;
  for (int i = 0; i < 10; ++i) {
    Pd0Ensemble ensemble = ToPd0Ensemble(Velocity(i), {});
    ensemble.number = static_cast<std::uint16_t>(i + 1);
    datagrams.push_back(EncodePd0(ensemble));
  }
  Run("dvl_pd0.yaml", "RAW_DVL", datagrams);
  ExpectVelocities(20.0 * std::cos(Pd0Params{}.beam_angle_rad));  // 20 m along its beams
}

TEST_F(DopplerLogOverUdp, Nmea2000GroupsArrive) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  std::vector<std::vector<std::uint8_t>> datagrams;
  for (int i = 0; i < 10; ++i)
    datagrams.push_back(
        EncodeCannelloni(EncodeDvlN2k(Velocity(i), 35, i), static_cast<std::uint8_t>(i)));
  Run("dvl_nmea2000.yaml", "RAW_CAN", datagrams);
  ExpectVelocities(20.0);
}

std::string OutputOf(const std::string& command) {
  std::string text;
  std::FILE* const pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), n);
  pclose(pipe);
  return text;
}

template <class T>
void ExpectBeams(const nlohmann::json& beams, const char* key, const std::vector<T>& values) {
  ASSERT_EQ(beams.size(), values.size());
  for (std::size_t i = 0; i < beams.size(); ++i)
    EXPECT_EQ(values[i], beams[i][key].get<T>()) << key << " of beam " << i;
}

// A sonar that serves its data over TCP: not there at first, in odd pieces with bytes of nothing
// between, gone in the middle of a packet, gone without a word, back.
TEST_F(DriverProcess, ASonarOverTcpIsWaitedForReadInPiecesAndConnectedToAgain) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  std::vector<mbes_ping_t> pings;
  std::size_t raw_bytes = 0;
  health_t health{};
  bus->Subscribe<mbes_ping_t>("MBES_PING", 0, [&](const mbes_ping_t& m) { pings.push_back(m); });
  bus->Subscribe<raw_bytes_t>(
      "RAW_MBES", 0, [&](const raw_bytes_t& m) { raw_bytes += m.data.size(); });
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { health = m; });
  const auto until_text = [&](const std::string& part) {
    return HandleUntil([&] { return health.text.find(part) != std::string::npos; }, 20'000);
  };
  const auto counter = [&](const std::string& name) -> std::int64_t {
    for (const counter_t& one : health.counters)
      if (one.name == name) return one.value;
    return 0;
  };
  const int port = FreeUdpPort();
  const auto process =
      Start("seastitch-mbes-driver",
            dir.Write("mbes_driver.yaml",
                      "source: tcp:127.0.0.1:" + std::to_string(port) + "\nformat: wbms\n"));
  ASSERT_TRUE(until_text("Connection refused")) << process->Output() << health.text;

  const auto packet = [](int i) {
    MbesPing ping;
    ping.time = FromUtime(1'700'000'000'000'000 + 50'000 * i);
    ping.ping_number = static_cast<std::uint32_t>(i);
    ping.sound_speed_mps = 1490.0;
    ping.beams.resize(512, {0.05f, 0.3f, 0, 0, 0, 40, kBeamPhase | kBeamValid});
    return EncodeWbms(ping);
  };
  TcpServer sonar(port);
  std::size_t sent = 0;
  const auto send = [&](const std::vector<std::uint8_t>& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 10'007)
      sonar.Send(Bytes(bytes).subspan(at, std::min<std::size_t>(10'007, bytes.size() - at)));
    sent += bytes.size();
    // Our end of the bus has small buffers here.
    EXPECT_TRUE(HandleUntil([&] { return raw_bytes == sent; }, 20'000));
  };
  ASSERT_TRUE(sonar.Accept());
  for (int i = 0; i < 5; ++i) send(packet(i));
  send(std::vector<std::uint8_t>(100, 0xEF));
  for (int i = 5; i < 10; ++i) send(packet(i));
  ASSERT_TRUE(HandleUntil([&] { return pings.size() == 10; }, 20'000)) << pings.size();
  ASSERT_TRUE(HandleUntil([&] { return health.state == health_t::STATE_OK; }, 20'000));

  std::vector<std::uint8_t> half = packet(10);
  half.resize(half.size() / 2);
  send(half);
  sonar.Close();
  ASSERT_TRUE(sonar.Accept());
  for (int i = 11; i < 15; ++i) send(packet(i));
  EXPECT_TRUE(HandleUntil([&] { return pings.size() == 14; }, 20'000)) << pings.size();
  sonar.Reset();
  ASSERT_TRUE(sonar.Accept());
  send(packet(15));
  EXPECT_TRUE(HandleUntil([&] { return pings.size() == 15; }, 20'000)) << pings.size();
  EXPECT_TRUE(HandleUntil([&] { return counter("tcp_connections") == 3; }, 20'000));
  EXPECT_EQ(counter("tcp_lost"), 2);
  EXPECT_EQ(counter("wbms_skipped_bytes"), 100 + static_cast<std::int64_t>(half.size()));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
  ASSERT_EQ(pings.size(), 15u);
  for (std::size_t i = 0; i < pings.size(); ++i) {
    EXPECT_EQ(pings[i].ping_number, static_cast<std::int64_t>(i < 10 ? i : i + 1));
    EXPECT_EQ(pings[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(pings[i].twtt_s.size(), 512u);
  }
}

TEST_F(DriverProcess, SixRealPingsArriveAsAnIndependentReaderReadsThem) {
  const std::string file = Shared("data/mbes/em2040_OS01.kmall");
  SKIP_WITHOUT(file);
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  const nlohmann::json expected = nlohmann::json::parse(
      OutputOf("python3 " + (SourceDir() / "tests/codecs/kongsberg/kmall_reference.py").string() +
               " " + file));
  ASSERT_EQ(expected.size(), 6u);

  std::vector<mbes_ping_t> pings;
  std::size_t raw_bytes = 0;
  std::optional<health_t> health;
  bus->Subscribe<mbes_ping_t>("MBES_PING", 0, [&](const mbes_ping_t& m) { pings.push_back(m); });
  bus->Subscribe<raw_bytes_t>(
      "RAW_MBES", 0, [&](const raw_bytes_t& m) { raw_bytes += m.data.size(); });
  bus->Subscribe<health_t>("HEALTH", 0, [&](const health_t& m) { health = m; });
  const int port = FreeUdpPort();
  const auto process =
      Start("seastitch-mbes-driver",
            WithSource(dir, "mbes_driver.yaml", "udp:127.0.0.1:" + std::to_string(port)));
  // Its first HEALTH says that it listens.
  ASSERT_TRUE(HandleUntil([&] { return health.has_value(); }, 10'000)) << process->Output();

  const std::vector<std::uint8_t> all = BytesOf(file);
  UdpSender sender(port);
  std::size_t sent = 0;
  for (std::size_t at = 0; at + 8 <= all.size();) {
    const auto size = ByteReader(Bytes(all).subspan(at)).Le<std::uint32_t>();
    const Bytes datagram = Bytes(all).subspan(at, size);
    for (const auto& part : SplitIntoParts(datagram, datagram[5] == 'M' ? 20'000 : 65'000)) {
      sender.Send(part);
      sent += part.size();
      // As a sonar does, not all at once: LCM's own buffers are small here.
      HandleUntil([&] { return raw_bytes >= sent; }, 2000);
    }
    at += size;
  }
  EXPECT_TRUE(HandleUntil([&] { return pings.size() == 6; }, 10'000));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS);
  EXPECT_EQ(raw_bytes, sent);

  ASSERT_EQ(pings.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    const auto& ping = expected[i];
    EXPECT_EQ(pings[i].seq, static_cast<std::int64_t>(i));
    EXPECT_EQ(pings[i].utime, ping["utime"].get<std::int64_t>());
    EXPECT_EQ(pings[i].ping_number, ping["ping_number"].get<std::int64_t>());
    EXPECT_EQ(pings[i].sound_speed_mps, ping["sound_speed_mps"].get<double>());
    ExpectBeams(ping["beams"], "twtt_s", pings[i].twtt_s);
    ExpectBeams(ping["beams"], "rx_angle_rad", pings[i].rx_angle_rad);
    ExpectBeams(ping["beams"], "tx_tilt_rad", pings[i].tx_tilt_rad);
    ExpectBeams(ping["beams"], "tx_delay_s", pings[i].tx_delay_s);
    ExpectBeams(ping["beams"], "depth_sigma_ratio", pings[i].depth_sigma_ratio);
    ExpectBeams(ping["beams"], "backscatter_db", pings[i].backscatter_db);
    ExpectBeams(ping["beams"], "flags", pings[i].flags);
  }
}

}  // namespace
}  // namespace seastitch
