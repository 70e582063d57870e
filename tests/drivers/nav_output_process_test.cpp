// seastitch-nav-output as people start it: a real process, UDP, a real terminal, and gpsd as the
// program that reads its sentences.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sysexits.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "codecs/navigation/nmea0183.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"
#include "common/runtime/health.hpp"
#include "seastitch/health_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/drivers/serial_line.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

const Datum kOrigin{43.07, -70.71};

class NavOutputProcess : public DriverProcess {
 protected:
  void SetUp() override {
    if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
    bus->Subscribe<health_t>("HEALTH", 0, [this](const auto& m) { health = m; });
    std::filesystem::copy_file(ConfigFile("vehicle.yaml"), dir.path() / "vehicle.yaml");
  }
  std::unique_ptr<Process> StartWith(const std::string& keys) {
    return Start("seastitch-nav-output",
                 dir.Write("nav_output.yaml", "vehicle: vehicle.yaml\n" + keys));
  }
  // Of a vehicle that goes east at 1.5 m/s, 30 m deep, at a known place. Times are the computer's.
  CorrectedNavState Corrected() {
    CorrectedNavState corrected;
    corrected.state.time = FromUtime(NowUtime());
    corrected.state.T_map_vehicle =
        MakePose({1200.0, -340.0, 30.0}, RotationFromRpy(0.0, 0.0, Deg2Rad(80.0)));
    corrected.state.v_map_mps = {0.0, 1.5, 0.0};
    corrected.state.covariance.diagonal() << 4.0, 9.0, 0.01, 1e-6, 1e-6, 1e-4;
    return corrected;
  }
  void SendNav() { bus->Publish("NAV_CORRECTED", ToLcm(Corrected(), seq++)); }
  // Sends NAV at 20 Hz until it is done.
  template <class Done>
  bool SendNavUntil(Done done, int timeout_ms) {
    auto next = std::chrono::steady_clock::now();
    return HandleUntil(
        [&] {
          if (std::chrono::steady_clock::now() >= next) {
            SendNav();
            next += std::chrono::milliseconds(50);
          }
          return done();
        },
        timeout_ms);
  }
  bool UntilText(const std::string& part) {
    return HandleUntil([&] { return health.text.find(part) != std::string::npos; }, 20'000);
  }
  health_t health{};
  std::int64_t seq = 0;
};

TEST_F(NavOutputProcess, WithNowhereToSendToItEndsWithOneLine) {
  const auto process = StartWith("");
  EXPECT_EQ(process->Wait(), EX_CONFIG);
  EXPECT_THAT(process->Output(), HasSubstr("nav_output.yaml: udp, serial: both are empty"));
  EXPECT_EQ(process->Output().find('\n'), process->Output().size() - 1);
}

TEST_F(NavOutputProcess, ASerialPortGetsWholeSentencesAndNothingWhileNavIsLost) {
  const std::filesystem::path link = dir.path() / "autopilot";
  SerialLine line(link);
  const auto process = StartWith("serial: \"serial:" + link.string() + "?baud=115200\"\n");
  std::string text;
  const auto read = [&] {
    while (WaitReadable(line.fd(), 0)) text += line.Receive();
    return text.find("$INZDA") != std::string::npos && text.ends_with("\n");
  };
  ASSERT_TRUE(SendNavUntil(read, 20'000)) << process->Output() << health.text;
  Counters counters;
  std::stringstream lines(text);
  for (std::string sentence; std::getline(lines, sentence);) {
    ASSERT_TRUE(sentence.ends_with("\r")) << sentence;
    EXPECT_TRUE(ParseNmea(sentence.substr(0, sentence.size() - 1), true, &counters)) << sentence;
  }
  EXPECT_TRUE(HandleUntil([&] { return health.state == health_t::STATE_LOST; }, 20'000));
  EXPECT_THAT(health.text, HasSubstr("nothing is sent: NAV_CORRECTED for"));
  read();
  text.clear();
  EXPECT_FALSE(HandleUntil(read, 500));
  EXPECT_EQ(text, "") << "no navigation, no sentence";

  line.Unplug();
  EXPECT_TRUE(
      SendNavUntil([&] { return health.text.find("cannot be sent") != std::string::npos; }, 20'000))
      << health.text;
  line.Plug();
  EXPECT_TRUE(SendNavUntil(read, 20'000)) << process->Output();
  EXPECT_TRUE(SendNavUntil([&] { return health.state == health_t::STATE_OK; }, 20'000))
      << health.text;
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// A client of gpsd that asks for everything, as JSON.
class GpsdClient {
 public:
  explicit GpsdClient(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    for (int i = 0; i < 100 && !connected_; ++i) {
      connected_ = connect(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
      if (!connected_) usleep(50'000);
    }
    if (!connected_) return;
    const std::string watch = "?WATCH={\"enable\":true,\"json\":true};\n";
    EXPECT_EQ(write(fd_.get(), watch.data(), watch.size()), static_cast<ssize_t>(watch.size()));
  }
  bool connected() const { return connected_; }
  // Reads what has come; true once there is a report of the class that the condition takes.
  bool Has(const std::string& report_class,
           const std::function<bool(const nlohmann::json&)>& takes) {
    char buffer[4096];
    while (WaitReadable(fd_.get(), 0)) {
      const ssize_t size = read(fd_.get(), buffer, sizeof buffer);
      if (size <= 0) break;
      text_.append(buffer, static_cast<std::size_t>(size));
    }
    for (std::size_t end; (end = text_.find('\n')) != std::string::npos; text_.erase(0, end + 1)) {
      const auto report = nlohmann::json::parse(text_.substr(0, end), nullptr, false);
      if (!report.is_object() || report.value("class", "") != report_class || !takes(report))
        continue;
      last = report;
      return true;
    }
    return false;
  }
  nlohmann::json last;

 private:
  FileDescriptor fd_;
  bool connected_ = false;
  std::string text_;
};

TEST_F(NavOutputProcess, GpsdTakesPositionSpeedAndErrors) {
  if (std::system("command -v gpsd >/dev/null") != 0) GTEST_SKIP() << "no gpsd here";
  const int sentences_port = FreeUdpPort(), gpsd_port = FreeUdpPort();
  Process gpsd("gpsd",
               {"-N",
                "-n",
                "-S",
                std::to_string(gpsd_port),
                "udp://127.0.0.1:" + std::to_string(sentences_port)},
               (dir.path() / "gpsd.txt").string());
  usleep(300'000);
  GpsdClient client(gpsd_port);
  ASSERT_TRUE(client.connected()) << gpsd.Output();
  const auto process = StartWith("udp: \"udp:127.0.0.1:" + std::to_string(sentences_port) + "\"\n");
  ASSERT_TRUE(SendNavUntil(
      [&] {
        return client.Has("TPV", [](const nlohmann::json& r) {
          return r.contains("lat") && r.contains("speed") && r.contains("track");
        });
      },
      30'000))
      << process->Output() << gpsd.Output();
  const nlohmann::json tpv = client.last;
  const Datum place = MapFrame(kOrigin).PointAt({1200.0, -340.0}, 30.0);
  EXPECT_NEAR(tpv.at("lat").get<double>(), place.latitude_deg, 2e-8);
  EXPECT_NEAR(tpv.at("lon").get<double>(), place.longitude_deg, 2e-8);
  EXPECT_NEAR(tpv.at("speed").get<double>(), 1.5, 1e-3);
  EXPECT_NEAR(tpv.at("track").get<double>(), 90.0, 0.01);
  EXPECT_NEAR(tpv.at("altMSL").get<double>(), -30.0, 0.01);
  EXPECT_EQ(tpv.at("mode"), 3);
  ASSERT_TRUE(SendNavUntil(
      [&] { return client.Has("GST", [](const nlohmann::json& r) { return r.contains("lat"); }); },
      30'000));
  EXPECT_NEAR(client.last.at("lat").get<double>(), 2.0, 1e-3);
  EXPECT_NEAR(client.last.at("lon").get<double>(), 3.0, 1e-3);
  EXPECT_NEAR(client.last.at("alt").get<double>(), 0.1, 1e-3);
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

}  // namespace
}  // namespace seastitch
