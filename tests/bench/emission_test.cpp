#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bench/live.hpp"
#include "bench/log.hpp"
#include "bench/truth.hpp"
#include "codecs/kongsberg/kmall_stream.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/config/config.hpp"
#include "common/storage/event_log.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/file_descriptor.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "tests/bench/bench_fixtures.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch::bench {
namespace {

class SurveyFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("seastitch_bench_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& text) const {
    const std::filesystem::path path = folder_ / "survey.yaml";
    std::ofstream(path) << text;
    return path.string();
  }

  std::filesystem::path folder_;
};

LogResult LogShortSurvey(const std::filesystem::path& path) {
  const DriverConfigs drivers = ShippedDrivers();
  SurveySimulator simulator(ShortSurvey(), CrookedVehicle(), drivers.signals());
  return WriteLog(&simulator, drivers, {}, path, nullptr);
}

TEST_F(SurveyFiles, LogHoldsWhatTheDriversPublish) {
  const LogResult result = LogShortSurvey(folder_ / "a.lcmlog");
  EventLogReader reader(folder_ / "a.lcmlog");
  std::map<std::string, std::int64_t> channels;
  std::int64_t last = ToUtime(kSurveyStart);
  while (const auto event = reader.Next()) {
    ++channels[event->channel];
    EXPECT_GE(event->utime, last);
    last = event->utime;
    if (event->channel != "IMU") continue;
    imu_t imu{};
    ASSERT_GT(imu.decode(event->data.data(), 0, int(event->data.size())), 0);
    EXPECT_EQ(imu.seq, channels["IMU"] - 1);
    EXPECT_EQ(imu.recv_utime, event->utime);
  }
  EXPECT_EQ(reader.damaged_bytes(), 0);
  EXPECT_EQ(channels, result.channels);
  EXPECT_EQ(channels["SVP"], 1);
  EXPECT_EQ(channels["RAW_MBES"], channels["MBES_PING"] + 1);
  EXPECT_EQ(channels["RAW_CAN"], channels["IMU"] + channels["DVL"]);
  EXPECT_EQ(channels["DEPTH"], channels["DVL"]);
  EXPECT_GT(channels["MBES_PING"], 100);
}

TEST_F(SurveyFiles, SameSurveySameLog) {
  LogShortSurvey(folder_ / "a.lcmlog");
  LogShortSurvey(folder_ / "b.lcmlog");
  EXPECT_EQ(TextOf(folder_ / "a.lcmlog"), TextOf(folder_ / "b.lcmlog"));
  EXPECT_EQ(TextOf(folder_ / "a.lcmlog.truth.csv"), TextOf(folder_ / "b.lcmlog.truth.csv"));
}

TEST_F(SurveyFiles, TruthStartsAtTheOriginAndGoesToTheEnd) {
  LogShortSurvey(folder_ / "a.lcmlog");
  std::ifstream in(TruthPathFor(folder_ / "a.lcmlog"));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "utime_us,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg");
  std::getline(in, line);
  EXPECT_EQ(line.rfind("1767225600000000,0.0000,0.0000,", 0), 0u) << line;
  int lines = 1;
  while (std::getline(in, line)) ++lines;
  const SurveySimulator simulator(ShortSurvey(), CrookedVehicle(), ShippedDrivers().signals());
  EXPECT_EQ(lines, static_cast<int>(ToSeconds(simulator.total()) * 20.0) + 1);
}

TEST_F(SurveyFiles, LogThatCannotBeWrittenIsNamed) {
  const std::filesystem::path path = folder_ / "missing" / "a.lcmlog";
  try {
    LogShortSurvey(path);
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find(path.string()), std::string::npos) << e.what();
  }
}

class Listener {
 public:
  Listener() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    socklen_t length = sizeof address;
    getsockname(fd_.get(), reinterpret_cast<sockaddr*>(&address), &length);
    target = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  // What waits, or nothing.
  std::vector<std::uint8_t> Receive() {
    std::vector<std::uint8_t> bytes(65'536);
    const ssize_t size = recv(fd_.get(), bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes;
  }

  std::string target;

 private:
  FileDescriptor fd_;
};

TEST(Live, SendsTheSimulatorsBytes) {
  SurveyConfig config = ShortSurvey();
  config.mbes.beams = 16;  // small enough for the socket's own buffer
  config.plan.line_length_m = 1.0;
  config.plan.lead_in_m = 1.0;
  Listener imu;
  Listener dvl;
  Listener mbes;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  double done = 0.0;
  const LiveResult result =
      SendLive(&simulator, {imu.target, dvl.target, mbes.target}, 1e6, [&done](double part) {
        done = part;
        return true;
      });
  EXPECT_GT(done, 0.4);
  EXPECT_EQ(result.refused, 0);

  SurveySimulator again(config, CrookedVehicle(), ShippedDrivers().signals());
  std::uint8_t imu_seq = 0;
  std::uint8_t dvl_seq = 0;
  std::int64_t packets = 0;
  for (; const auto event = again.Next(); ++packets) {
    if (event->device == Device::kMbes) {
      EXPECT_EQ(mbes.Receive(), event->bytes);
      continue;
    }
    const bool is_imu = event->device == Device::kImu;
    const auto packet = DecodeCannelloni((is_imu ? imu : dvl).Receive());
    ASSERT_TRUE(packet);
    EXPECT_EQ(packet->seq, is_imu ? imu_seq++ : dvl_seq++);
    EXPECT_EQ(packet->frames, event->frames);
  }
  EXPECT_EQ(packets, result.packets);
}

TEST(Live, SendsPositionFixesOnTheBus) {
  SurveyConfig config = ShortSurvey();
  config.fixes.interval_s = 2.0;
  config.fixes.gps = true;
  config.plan.surface_s = 5.0;
  const std::string lcm_url = "udpm://239.255.76.67:" + std::to_string(7000 + getpid() % 20000) +
                              "?ttl=0&recv_buf_size=4194304";
  Bus bus(lcm_url);
  std::vector<position_fix_t> heard;
  bus.Subscribe<position_fix_t>(
      channels::kPositionFix, 0, [&](const position_fix_t& fix) { heard.push_back(fix); });
  Listener sink;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  SendLive(&simulator, {sink.target, sink.target, sink.target, lcm_url}, 1e6, nullptr);
  bus.HandleUntilQuiet();

  SurveySimulator again(config, CrookedVehicle(), ShippedDrivers().signals());
  std::size_t i = 0;
  while (const auto event = again.Next()) {
    if (!event->fix) continue;
    ASSERT_LT(i, heard.size());
    EXPECT_EQ(heard[i].utime, ToUtime(event->fix->time));
    EXPECT_EQ(heard[i].source, "gps");
    EXPECT_EQ(heard[i].seq, static_cast<std::int64_t>(i));
    ++i;
  }
  EXPECT_EQ(i, heard.size());
  EXPECT_GT(i, 3u);
}

// After a power cut of the vehicle: the devices went on meanwhile.
TEST(Live, JoinsALaterSecondOfTheSameSurvey) {
  SurveyConfig config = ShortSurvey();
  config.mbes.beams = 16;
  config.plan.line_length_m = 1.0;
  config.plan.lead_in_m = 1.0;
  config.start = FromUtime(1'800'000'000'000'000);
  Listener imu;
  Listener dvl;
  Listener mbes;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  const LiveResult result =
      SendLive(&simulator, {imu.target, dvl.target, mbes.target}, 1e6, nullptr, {.survey_s = 1.0});

  SurveySimulator again(config, CrookedVehicle(), ShippedDrivers().signals());
  EXPECT_EQ(again.start(), config.start);
  const auto profile = again.Next();
  ASSERT_EQ(profile->device, Device::kMbes);
  EXPECT_EQ(mbes.Receive(), profile->bytes);
  std::int64_t packets = 1;
  while (const auto event = again.Next()) {
    if (event->recv < config.start + std::chrono::seconds(1)) continue;
    ++packets;
    if (event->device == Device::kMbes) {
      EXPECT_EQ(mbes.Receive(), event->bytes);
      continue;
    }
    const auto packet = DecodeCannelloni((event->device == Device::kImu ? imu : dvl).Receive());
    ASSERT_TRUE(packet);
    EXPECT_EQ(packet->frames, event->frames);
  }
  EXPECT_EQ(packets, result.packets);
  EXPECT_GT(packets, 10);
}

TEST(Live, LeavesOutWhatLiesInThePast) {
  SurveyConfig config = ShortSurvey();
  Listener all;
  const auto packets = [&](std::chrono::seconds ago) {
    config.start = FromUtime(std::chrono::duration_cast<std::chrono::microseconds>(
                                 std::chrono::system_clock::now().time_since_epoch())
                                 .count()) -
                   ago;
    SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
    return SendLive(&simulator,
                    {all.target, all.target, all.target},
                    1e6,
                    [](double) { return false; },  // the first packet is enough
                    {.survey_s = 0.0, .now = true})
        .packets;
  };
  EXPECT_EQ(packets(std::chrono::seconds(86'400)), 1) << "the profile of a survey that is over";
  EXPECT_EQ(packets(std::chrono::seconds(-3600)), 1);
}

TEST(Live, CountsWhatNobodyTakes) {
  std::string target;
  {
    const Listener gone;
    target = gone.target;
  }
  SurveyConfig config = ShortSurvey();
  config.plan.line_length_m = 1.0;
  config.plan.lead_in_m = 1.0;
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  EXPECT_GT(SendLive(&simulator, {target, target, target}, 1e6, nullptr).refused, 0);
}

TEST(Live, RefusesATargetThatIsNone) {
  SurveySimulator simulator(ShortSurvey(), CrookedVehicle(), ShippedDrivers().signals());
  EXPECT_THROW(SendLive(&simulator, {"127.0.0.1", "127.0.0.1:1", "127.0.0.1:1"}, 1.0, nullptr),
               std::runtime_error);
  EXPECT_THROW(SendLive(&simulator, {"127.0.0.1:1", "127.0.0.1:1", "127.0.0.1:1"}, 0.0, nullptr),
               std::invalid_argument);
}

class ShippedSurvey : public ::testing::TestWithParam<const char*> {};

TEST_P(ShippedSurvey, LoadsAndMakesASurvey) {
  const SurveyConfig config = LoadSurvey(ConfigFile(std::string("bench/") + GetParam()));
  SurveySimulator simulator(config, CrookedVehicle(), ShippedDrivers().signals());
  EXPECT_GT(ToSeconds(simulator.total()), 300.0);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(simulator.Next());
  EXPECT_GT(simulator.counts().soundings, 0);
}

INSTANTIATE_TEST_SUITE_P(Files,
                         ShippedSurvey,
                         ::testing::Values("demo.yaml",
                                           "large.yaml",
                                           "flat.yaml",
                                           "sand_waves.yaml",
                                           "high_above.yaml",
                                           "close_above.yaml"));

TEST_F(SurveyFiles, UnknownKeysStop) {
  const auto reason = [this](const std::string& text) {
    try {
      LoadSurvey(Write(text));
    } catch (const ConfigError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(reason("plan: {linse: 3}").find("plan.linse"), std::string::npos);
  EXPECT_NE(reason("errors: {class: best}").find("ins_tactical"), std::string::npos);
  EXPECT_NE(reason("mbes: {beams: 1}").find("beams"), std::string::npos);
  EXPECT_NE(reason("faults: [{kind: shark}]").find("shark"), std::string::npos);
  EXPECT_NE(reason("terrain: {relief: {rms_m: wide}}").find("rms_m"), std::string::npos);
}

TEST_F(SurveyFiles, FaultsAndRasterAreReadFromTheFile) {
  const SurveyConfig config =
      LoadSurvey(Write("terrain: {raster: {file: seabed.tif}}\n"
                       "faults:\n"
                       "  - {kind: dvl_dropout, from_s: 10, to_s: 20}\n"
                       "  - {kind: packet_loss, device: imu, rate: 0.5}\n"));
  EXPECT_EQ(config.raster.file, (folder_ / "seabed.tif").string());
  ASSERT_EQ(config.faults.size(), 2u);
  EXPECT_EQ(config.faults[0].to_s, 20.0);
  EXPECT_EQ(config.faults[1].device, Device::kImu);
}

TEST(Fault, SaysWhatIsWrong) {
  EXPECT_THROW(ParseFault("shark"), std::invalid_argument);
  EXPECT_THROW(ParseFault("packet_loss:rate=2"), std::invalid_argument);
  EXPECT_THROW(ParseFault("packet_loss:rate=often"), std::invalid_argument);
  EXPECT_THROW(ParseFault("packet_loss:device=dog"), std::invalid_argument);
  EXPECT_THROW(ParseFault("dvl_dropout:from_s"), std::invalid_argument);
  EXPECT_THROW(ParseFault("dvl_dropout:from_s=9,to_s=3"), std::invalid_argument);
  EXPECT_EQ(ParseFault("dvl_dropout:from_s=300,to_s=330").to_s, 330.0);
}

}  // namespace
}  // namespace seastitch::bench
