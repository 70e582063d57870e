#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <chrono>
#include <fstream>
#include <sstream>

#include "common/runtime/config/config.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/socket/byte_source.hpp"
#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/sender_gate.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/tcp_socket.hpp"
#include "drivers/socket/udp_socket.hpp"
#include "tests/drivers/loopback.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

const std::vector<CanFilter> kEcan = {{0x120, false}, {0x121, false}};

template <class Fn>
std::string ErrorOf(Fn fn) {
  try {
    fn();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "no error";
}

std::string OpenError(const std::string& url) {
  return ErrorOf([&] { OpenCanSource(url, kEcan, 65536); });
}

// Everything that a source gives until its end, waiting for it as a loop does.
std::vector<ReceivedFrame> ReadAll(CanSource* source) {
  std::vector<ReceivedFrame> all;
  while (!source->finished()) {
    pollfd waiting{source->fd(), POLLIN, 0};
    if (poll(&waiting, 1, 5000) <= 0) {
      ADD_FAILURE() << "the source does not wake";
      break;
    }
    for (const ReceivedFrame& frame : source->Receive()) all.push_back(frame);
  }
  return all;
}

// Frames of a log as a driver of bytes has them: packets, and what the controller says apart.
TEST(CanBytes, ArePacketsOfFramesThatCameTogether) {
  const TemporaryDir dir;
  const std::string file = dir.Write("can.log",
                                     "(100.000000) can0 120#01\n"
                                     "(100.000900) can0 121#02\n"
                                     "(100.000950) can0 130#03\n"
                                     "(100.001100) can0 121#04\n"
                                     "(100.002000) can0 20000040#0000000000000000\n");
  const auto source = OpenCanBytes("candump:" + file + "?speed=0", kEcan, 65536);
  std::vector<Datagram> pieces;
  Datagram piece;
  while (WaitReadable(source->fd()) && !source->finished())
    while (source->Receive(&piece)) pieces.push_back(piece);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(ToUtime(pieces[0].recv), 100'000'900);
  const auto first = DecodeCannelloni(pieces[0].bytes), second = DecodeCannelloni(pieces[1].bytes);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(second->seq, first->seq + 1);
  ASSERT_EQ(first->frames.size(), 2u);
  EXPECT_EQ(first->frames[1].bytes[0], 2);
  EXPECT_EQ(source->can_trouble(), "controller is bus-off");
  EXPECT_EQ(source->counters().at("can_bus_off"), 1);
}

TEST(CandumpSource, GivesTheFilteredFramesWithTheLogsStampsAndEnds) {
  SKIP_WITHOUT(Shared("vectors/candump"));
  const std::string file = Shared("vectors/candump/sample_candump.log");
  const auto source = OpenCanSource("candump:" + file + "?speed=0", kEcan, 65536);
  const std::vector<ReceivedFrame> frames = ReadAll(source.get());
  // IMU_INFO, IMU_ACCEL and the one error frame.
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].frame.id, 0x120u);
  EXPECT_EQ(ToUtime(frames[0].recv), 1700000000255000);
  EXPECT_EQ(frames[1].frame.id, 0x121u);
  EXPECT_TRUE(frames[2].frame.error);
}

TEST(CandumpSource, KeepsThePaceItIsAskedFor) {
  const TemporaryDir dir;
  const std::string file = dir.Write(
      "a.log", "(100.000000) can0 120#00\n(100.400000) can0 120#01\n(101.000000) can0 120#02\n");
  const auto started = std::chrono::steady_clock::now();
  const auto source = OpenCanSource("candump:" + file + "?speed=20", kEcan, 65536);
  EXPECT_EQ(ReadAll(source.get()).size(), 3u);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
  EXPECT_GE(took.count(), 0.049);
}

TEST(CandumpSource, MalformedLinesAreCountedAndOthersIgnored) {
  const TemporaryDir dir;
  const std::string file =
      dir.Write("a.log", "# note\n\n(100.000000) can0 120#0\n(100.000000) can0 120#00\n");
  const auto source = OpenCanSource("candump:" + file + "?speed=0", kEcan, 65536);
  EXPECT_EQ(ReadAll(source.get()).size(), 1u);
  EXPECT_EQ(source->counters().at("candump_malformed"), 1);
}

TEST(CannelloniSource, GivesFramesOfPacketsAndCountsTheRest) {
  const int port = FreeUdpPort();
  const auto source = OpenCanSource("udp:127.0.0.1:" + std::to_string(port), kEcan, 1 << 20);
  UdpSender sender(port);
  CanFrame wanted;
  wanted.id = 0x120;
  CanFrame other;
  other.id = 0x7AB;
  const std::vector<CanFrame> frames = {wanted, other, wanted};
  sender.Send(EncodeCannelloni(frames, 255));
  sender.Send(EncodeCannelloni(frames, 0));
  sender.Send({9, 9, 9});
  sender.Send(EncodeCannelloni(frames, 3));  // 1 and 2 never came
  std::vector<ReceivedFrame> all;
  while (all.size() < 6) {
    pollfd waiting{source->fd(), POLLIN, 0};
    ASSERT_GT(poll(&waiting, 1, 5000), 0);
    for (const ReceivedFrame& frame : source->Receive()) all.push_back(frame);
  }
  EXPECT_EQ(all.size(), 6u);
  EXPECT_LT(std::abs(ToUtime(all[0].recv) - NowUtime()), 10'000'000);
  EXPECT_EQ(source->counters().at("cannelloni_malformed"), 1);
  EXPECT_EQ(source->counters().at("cannelloni_gaps"), 1);
}

TEST(UdpSocket, CountsWhatTheKernelDropped) {
  const int port = FreeUdpPort();
  UdpSocket socket("udp:127.0.0.1:" + std::to_string(port), 8192);
  UdpSender sender(port);
  const std::vector<std::uint8_t> kilobyte(1024);
  for (int i = 0; i < 200; ++i) sender.Send(kilobyte);
  Datagram datagram;
  int received = 0;
  while (socket.Receive(&datagram)) ++received;
  // The count comes with the first datagram that the socket has room for again.
  sender.Send(kilobyte);
  ASSERT_TRUE(WaitReadable(socket.fd()));
  while (socket.Receive(&datagram)) ++received;
  ASSERT_LT(received, 201);
  EXPECT_EQ(received + socket.counters().at("udp_dropped"), 201);
  EXPECT_GT(socket.counters().at("udp_receive_buffer_bytes"), 0);
  EXPECT_FALSE(socket.counters().contains("udp_unstamped"));
}

TEST(UdpSocket, TellsSendersApart) {
  const int port = FreeUdpPort();
  UdpSocket socket("udp:127.0.0.1:" + std::to_string(port), 65536);
  UdpSender one(port);
  UdpSender two(port);
  Datagram a;
  Datagram b;
  one.Send({1});
  ASSERT_TRUE(WaitReadable(socket.fd()));
  ASSERT_TRUE(socket.Receive(&a));
  two.Send({2});
  ASSERT_TRUE(WaitReadable(socket.fd()));
  ASSERT_TRUE(socket.Receive(&b));
  EXPECT_NE(a.sender, b.sender);
  EXPECT_FALSE(socket.Receive(&b));
}

// --- a device that serves its data over TCP ---

TEST(TcpSocket, RefusedItTriesAgainAndTellsOfTheConnectionItLost) {
  const int port = FreeUdpPort();
  TcpSocket socket("tcp:127.0.0.1:" + std::to_string(port));
  Datagram piece;
  ASSERT_TRUE(WaitReadable(socket.fd()));
  EXPECT_FALSE(socket.Receive(&piece));
  EXPECT_EQ(socket.trouble(), "Connection refused");
  EXPECT_TRUE(socket.counters().empty());
  TcpServer device(port);
  ASSERT_TRUE(WaitReadable(socket.fd())) << "time to try again";
  EXPECT_FALSE(socket.Receive(&piece));
  ASSERT_TRUE(device.Accept());
  socket.Check();
  EXPECT_EQ(socket.trouble(), "");
  device.Send(std::vector<std::uint8_t>{1, 2, 3});
  ASSERT_TRUE(WaitReadable(socket.fd()));
  ASSERT_TRUE(socket.Receive(&piece));
  EXPECT_EQ(piece.bytes, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_GT(piece.recv, FromUtime(1'500'000'000'000'000));
  EXPECT_FALSE(socket.Receive(&piece));
  device.Close();
  ASSERT_TRUE(WaitReadable(socket.fd()));
  EXPECT_FALSE(socket.Receive(&piece));
  EXPECT_EQ(socket.trouble(), "the device closed the connection");
  EXPECT_EQ(socket.counters(), (Counters{{"tcp_connections", 1}, {"tcp_lost", 1}}));
}

// The queue of the device's kernel is full: it answers nobody.
TEST(TcpSocket, ADeviceThatDoesNotAnswerIsNamed) {
  const int port = FreeUdpPort();
  const TcpServer device(port);
  const std::string url = "tcp:127.0.0.1:" + std::to_string(port);
  std::vector<std::unique_ptr<TcpSocket>> fillers;
  for (int i = 0; i < 4; ++i) fillers.push_back(std::make_unique<TcpSocket>(url));
  TcpSocket& last = *fillers.back();
  EXPECT_EQ(last.trouble(), "not connected");
  for (int i = 0; i < 3; ++i) last.Check();
  EXPECT_EQ(last.trouble(), "no answer");
  EXPECT_TRUE(last.counters().empty());
}

TEST(TcpSocket, OnlyStreamsComeOverIt) {
  EXPECT_NO_THROW(ExpectUsable("tcp:10.0.0.5:2210", SourceKind::kStream));
  EXPECT_NO_THROW(ExpectUsable("tcp:10.0.0.5:2210", SourceKind::kBytes));
  const auto error = [](const std::string& url, SourceKind kind) {
    return ErrorOf([&] { ExpectUsable(url, kind); });
  };
  EXPECT_THAT(error("udp:0.0.0.0:2210", SourceKind::kStream), HasSubstr("expected tcp:HOST:PORT"));
  EXPECT_THAT(error("tcp:10.0.0.5:2210", SourceKind::kDatagrams), HasSubstr("expected udp:"));
  EXPECT_THAT(error("tcp:10.0.0.5:2210", SourceKind::kCan), HasSubstr("expected can:"));
  EXPECT_THAT(error("tcp:10.0.0.5", SourceKind::kStream), HasSubstr("expected tcp:HOST:PORT"));
  EXPECT_THAT(error("tcp::2210", SourceKind::kStream), HasSubstr("expected tcp:HOST:PORT"));
  EXPECT_THAT(error("tcp:10.0.0.5:0", SourceKind::kStream), HasSubstr("'0' is not a port"));
  EXPECT_THAT(error("tcp:10.0.0.5:2210?from=10.0.0.5", SourceKind::kStream),
              HasSubstr("unknown option"));
}

TEST(SenderGate, TakesTheFirstThatIsUnderstoodUntilItIsSilentForFiveSeconds) {
  SenderGate gate;
  const auto at = [](double s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(s); };
  const auto sends = [&](std::uint32_t address, double s) {
    const bool accepted = gate.Accepts(address, at(s));
    if (accepted) gate.Understood(address, at(s));
    return accepted;
  };
  EXPECT_TRUE(sends(1, 0.0));
  EXPECT_FALSE(sends(2, 1.0));
  EXPECT_TRUE(sends(1, 2.0));
  EXPECT_FALSE(sends(2, 6.9));  // what is refused does not count as silence's end
  EXPECT_TRUE(sends(2, 7.0));
  EXPECT_FALSE(sends(1, 7.1));
  EXPECT_TRUE(sends(2, -3600.0));  // the clock was set back
  EXPECT_FALSE(sends(1, -3599.0));
}

TEST(SenderGate, AStrangerThatIsNotUnderstoodNeverKeepsTheDeviceOut) {
  SenderGate gate;
  constexpr std::uint32_t kStranger = 1, kSonar = 2;
  for (double s = 0.0; s < 20.0; s += 1.0) {
    const Time t = FromUtime(1'700'000'000'000'000) + FromSeconds(s);
    EXPECT_EQ(gate.Accepts(kStranger, t), s < 11.0) << s;
    if (s < 10.0) continue;  // the sonar is switched on late
    EXPECT_TRUE(gate.Accepts(kSonar, t)) << s;
    gate.Understood(kSonar, t);
  }
}

TEST(SenderGate, TakesThoseConfiguredAlone) {
  SenderGate gate("10.0.0.5,10.0.0.6");
  EXPECT_TRUE(gate.Accepts(0x0A000005, Time{}));
  EXPECT_TRUE(gate.Accepts(0x0A000006, Time{}));
  EXPECT_FALSE(gate.Accepts(0x0A000007, Time{}));
}

TEST(UdpSocket, RefusesAndCountsOtherSenders) {
  const int port = FreeUdpPort();
  const UdpSender sonar(port, "127.0.0.1", "127.0.0.5"), other(port, "127.0.0.1", "127.0.0.6");
  const std::string url = "udp:127.0.0.1:" + std::to_string(port);
  for (const auto& [option, refusal] : std::map<std::string, std::string>{
           {"", "127.0.0.6, while 127.0.0.5 sends"},
           {"?from=127.0.0.5,127.0.0.7", "127.0.0.6, which is not named"}}) {
    UdpSocket socket(url + option, 65536);
    sonar.Send({1});
    other.Send({2});
    sonar.Send({3});
    ASSERT_TRUE(WaitReadable(socket.fd()));
    EXPECT_EQ(socket.refusal().last, "");
    Datagram datagram;
    std::vector<std::uint8_t> taken;
    while (socket.Receive(&datagram)) {
      taken.push_back(datagram.bytes.at(0));
      socket.Understood(datagram);
    }
    EXPECT_THAT(taken, testing::ElementsAre(1, 3)) << option;
    EXPECT_EQ(socket.counters().at("udp_refused_senders"), 1) << option;
    EXPECT_EQ(socket.refusal().last, refusal);
    EXPECT_EQ(socket.refusal().count, 1);
  }
}

TEST(UdpSocket, NamedSendersAreAddresses) {
  for (const char* senders :
       {"sonar", "", "10.0.0.5,", ",10.0.0.5", "10.0.0.5;10.0.0.6", "10.0.0"}) {
    const std::string url = std::string("udp:127.0.0.1:5000?from=") + senders;
    const auto expected = HasSubstr(url + ": from: '");
    EXPECT_THAT(ErrorOf([&] { UdpSocket(url, 65536); }), expected);
    EXPECT_THAT(ErrorOf([&] { ExpectUsable(url, SourceKind::kDatagrams); }), expected);
  }
  EXPECT_NO_THROW(ExpectUsable("udp:0.0.0.0:5000?from=10.0.0.5,10.0.0.6", SourceKind::kCan));
}

TEST(UdpSocket, JoinsAMulticastGroupAndSharesItsPort) {
  const int port = FreeUdpPort();
  const std::string url = "udp:239.255.43.21:" + std::to_string(port) + "?interface=lo";
  UdpSocket one(url, 65536);
  UdpSocket two(url, 65536);
  UdpSender sender(port, "239.255.43.21");
  sender.Send({42});
  if (!WaitReadable(one.fd(), 2000)) {
    GTEST_SKIP() << "no multicast on the loopback interface";
  }
  Datagram datagram;
  ASSERT_TRUE(one.Receive(&datagram));
  EXPECT_EQ(datagram.bytes, std::vector<std::uint8_t>{42});
  ASSERT_TRUE(WaitReadable(two.fd()));
  EXPECT_TRUE(two.Receive(&datagram));
}

TEST(Sources, ProblemsAreOneLineThatNamesTheUrl) {
  EXPECT_THAT(OpenError("can:no_such_if"),
              testing::AnyOf(testing::Eq("no error"),  // waited for: tests/hil
                             HasSubstr("can:no_such_if: this kernel has no CAN")));
  EXPECT_THAT(OpenError("candump:/nowhere.log"), HasSubstr("candump:/nowhere.log: not a file"));
  EXPECT_THAT(OpenError("candump:/"), HasSubstr("not a file"));
  EXPECT_THAT(OpenError("candump:/dev/null?speed=fast"), HasSubstr("speed 'fast'"));
  EXPECT_THAT(OpenError("candump:/dev/null?speed=-1"), HasSubstr("speed '-1'"));
  EXPECT_THAT(OpenError("candump:/dev/null?pace=1"), HasSubstr("unknown option 'pace=1'"));
  EXPECT_THAT(OpenError("can:can0?speed=1"), HasSubstr("unknown option"));
  EXPECT_THAT(OpenError("tcp:1.2.3.4:5"), HasSubstr("expected can:INTERFACE"));
  EXPECT_THAT(OpenError("can0"), HasSubstr("expected can:INTERFACE"));
  EXPECT_THAT(OpenError("udp:127.0.0.1"), HasSubstr("expected udp:HOST:PORT"));
  EXPECT_THAT(OpenError("udp:127.0.0.1:0"), HasSubstr("'0' is not a port"));
  EXPECT_THAT(OpenError("udp:127.0.0.1:70000"), HasSubstr("'70000' is not a port"));
  EXPECT_THAT(OpenError("udp:127.0.0.1:5000?interface=lo"), HasSubstr("multicast"));
}

TEST(UdpSocket, WaitsForAPortThatIsTaken) {
  const int port = FreeUdpPort();
  const std::string url = "udp:127.0.0.1:" + std::to_string(port);
  auto first = std::make_unique<UdpSocket>(url, 65536);
  UdpSocket second(url, 65536);
  EXPECT_EQ(second.trouble(), "cannot listen: Address already in use");
  Datagram datagram;
  EXPECT_FALSE(second.Receive(&datagram));
  first.reset();
  // It wakes the loop by itself.
  ASSERT_TRUE(WaitReadable(second.fd()));
  EXPECT_FALSE(second.Receive(&datagram));
  EXPECT_EQ(second.trouble(), "");
  UdpSender(port).Send({42});
  ASSERT_TRUE(WaitReadable(second.fd()));
  ASSERT_TRUE(second.Receive(&datagram));
  EXPECT_EQ(datagram.bytes, std::vector<std::uint8_t>{42});
}

TEST(UdpSocket, WaitsForAnInterfaceThatIsMissing) {
  const UdpSocket socket("udp:239.1.2.3:5000?interface=no_such_if", 65536);
  EXPECT_EQ(socket.trouble(), "no such interface: no_such_if");
}

// A shipped configuration with one text replaced.
class Config : public testing::Test {
 protected:
  std::string Changed(const std::string& file, const std::string& from, const std::string& to) {
    std::string content = TextOf(ConfigFile(file));
    const std::size_t at = content.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    content.replace(at, from.size(), to);
    for (const char* const dbc : {"sbg_ecan.dbc", "seastitch_dvl.dbc"})
      std::filesystem::copy_file(
          ConfigFile(dbc), dir.path() / dbc, std::filesystem::copy_options::overwrite_existing);
    return dir.Write(file, content);
  }
  std::string ImuError(const std::string& from, const std::string& to) {
    return ErrorOf([&] { LoadImuDriverConfig(Changed("imu_driver.yaml", from, to)); });
  }
  std::string DvlError(const std::string& from, const std::string& to) {
    return ErrorOf([&] { LoadDvlDriverConfig(Changed("dvl_driver.yaml", from, to)); });
  }
  std::string MbesError(const std::string& from, const std::string& to) {
    return ErrorOf([&] { LoadMbesDriverConfig(Changed("mbes_driver.yaml", from, to)); });
  }
  const TemporaryDir dir;
};

TEST_F(Config, EveryMistakeIsNamedByFileAndKey) {
  EXPECT_THAT(ImuError("latency_s: 0", "latency_ms: 3"),
              HasSubstr("imu_driver.yaml: latency_ms: unknown key"));
  EXPECT_THAT(ImuError("\nclock: device", "\nclock: gps"), HasSubstr("clock: 'gps' is not device"));
  EXPECT_THAT(ImuError("timeout_s: 2", "timeout_s: soon"), HasSubstr("timeout_s: 'soon'"));
  EXPECT_THAT(ImuError("timeout_s: 2", "timeout_s: -1"), HasSubstr("timeout_s: '-1' is not"));
  EXPECT_THAT(ImuError("source: \"can:can0\"", "source: ''"), HasSubstr("source: "));
  EXPECT_THAT(ImuError("max_epoch_s: 0.01", "max_epoch_s: 0"),
              HasSubstr("max_epoch_s: '0' is not"));
  EXPECT_THAT(ImuError("dbc: sbg_ecan.dbc", "dbc: other.dbc"),
              HasSubstr("other.dbc:0: not a file"));
  EXPECT_THAT(ImuError("IMU_GYRO.GYRO_X", "IMU_GYRO.GYRO_Q"),
              HasSubstr("signals.angular_rate_x_radps: 'IMU_GYRO.GYRO_Q': no such signal"));
  EXPECT_THAT(ImuError("  yaw_rad:", "  heading_rad:"),
              HasSubstr("signals.heading_rad: unknown key"));
  EXPECT_THAT(ImuError("  yaw_rad: EKF_EULER.YAW\n", ""), HasSubstr("signals.yaw_rad: missing"));
  EXPECT_THAT(ImuError("  utc_year: UTC_1.YEAR\n", ""), HasSubstr("signals.utc_year: missing"));
  EXPECT_THAT(DvlError("  sigma_z_mps: DVL_SIGMA.SIGMA_Z\n", ""),
              HasSubstr("dvl_driver.yaml: signals.sigma_z_mps: missing"));
  EXPECT_THAT(DvlError("max_ensemble_s: 0.03", "max_ensemble_s: 5"),
              HasSubstr("max_ensemble_s: '5' is not"));
  EXPECT_THAT(MbesError("max_parts: 32", "max_parts: 0"), HasSubstr("parts.max_parts: '0' is not"));
  EXPECT_THAT(MbesError("max_parts: 32", "most_parts: 3"),
              HasSubstr("mbes_driver.yaml: parts.most_parts: unknown key"));
  EXPECT_THAT(MbesError("receive_buffer_bytes: 16777216", "receive_buffer_bytes: 1"),
              HasSubstr("receive_buffer_bytes: '1' is not"));
}

TEST_F(Config, ASourceThatCanNeverBeOpenedIsAMistakeToo) {
  const auto imu = [&](const std::string& source) {
    return ImuError("source: \"can:can0\"", "source: \"" + source + "\"");
  };
  EXPECT_THAT(imu("usb:can0"),
              HasSubstr("imu_driver.yaml: source: usb:can0: expected can:INTERFACE"));
  EXPECT_THAT(imu("udp:127.0.0.1:60200000"), HasSubstr("'60200000' is not a port"));
  EXPECT_THAT(imu("udp::5000"), HasSubstr("expected udp:HOST:PORT"));
  EXPECT_THAT(imu("udp:127.0.0.1:5000?interface="), HasSubstr("not the name of an interface"));
  EXPECT_THAT(imu("can:"), HasSubstr("'' is not the name of an interface"));
  EXPECT_THAT(imu("can:" + std::string(25, 'x')), HasSubstr("not the name of an interface"));
  EXPECT_THAT(imu("candump:/nowhere.log"), HasSubstr("not a file that can be read"));
  EXPECT_THAT(imu("candump:/dev/null?speed=fast"), HasSubstr("speed 'fast'"));
  // What may come later is waited for.
  for (const char* source : {"can:no_such_if", "can:exactly_fifteen", "udp:0.0.0.0:5000"})
    EXPECT_NO_THROW(LoadImuDriverConfig(Changed(
        "imu_driver.yaml", "source: \"can:can0\"", std::string("source: \"") + source + "\"")));
  for (const char* source : {"can:can0", "candump:/dev/null", "udp:127.0.0.1"})
    EXPECT_THAT(
        ErrorOf([&] {
          LoadMbesDriverConfig(dir.Write("m.yaml", std::string("source: \"") + source + "\"\n"));
        }),
        HasSubstr("m.yaml: source: " + std::string(source) + ": expected udp:HOST:PORT"));
  EXPECT_THAT(
      ErrorOf([&] {
        LoadMbesDriverConfig(dir.Write("m.yaml", "source: \"udp:0.0.0.0:2210\"\nformat: wbms\n"));
      }),
      HasSubstr("m.yaml: source: udp:0.0.0.0:2210: expected tcp:HOST:PORT"));
}

TEST_F(Config, ABrokenDbcIsNamedByItsLine) {
  const std::string yaml = Changed("imu_driver.yaml", "latency_s: 0", "latency_s: 0");
  dir.Write("sbg_ecan.dbc", "VERSION \"\"\nBO_ 1 M: 8 X\n SG_ A : 99|8@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_THAT(ErrorOf([&] { LoadImuDriverConfig(yaml); }),
              HasSubstr("sbg_ecan.dbc:3: signal A lies outside its message"));
}

TEST_F(Config, WithTheReceiveClockNoUtcIsNeeded) {
  Changed("imu_driver.yaml", "  utc_time_us: UTC_0.TIME_STAMP\n", "");
  std::string content = TextOf(dir.path() / "imu_driver.yaml");
  content = content.substr(0, content.find("  utc_time_of_week_ms"));
  content.replace(content.find("clock: device"), 13, "clock: receive");
  EXPECT_NO_THROW(LoadImuDriverConfig(dir.Write("imu.yaml", content)));
}

}  // namespace
}  // namespace seastitch
