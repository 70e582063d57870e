// seastitch-nav-driver as people start it: a real process, UDP, a real terminal as serial port.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sysexits.h>

#include <filesystem>

#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/navigation_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/drivers/serial_line.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

constexpr char kGga[] =
    "$GPGGA,102030.50,5730.123456,N,01115.654321,E,4,14,0.8,3.25,M,40.50,M,1.2,0123*4C\r\n";
constexpr char kNoFix[] = "$GPGGA,102031.00,5730.1234,S,01115.6543,W,0,00,,,M,,M,,*78\r\n";

// Of epoch i: EKF_INFO, EKF_VEL_NED whose north is 0.25 m/s * i, and a frame of another device.
std::vector<CanFrame> EcanFrames(int i) {
  ByteWriter info, velocity;
  info.Le(static_cast<std::uint32_t>(20'000 * (i + 1)));
  velocity.Le(static_cast<std::int16_t>(25 * (i % 100)));
  velocity.Zeros(4);
  std::vector<CanFrame> frames(3);
  frames[0].id = 0x130;
  frames[0].SetData(info.bytes());
  frames[1].id = 0x139;
  frames[2].id = 0x137;
  frames[2].SetData(velocity.bytes());
  return frames;
}

class NavProcess : public DriverProcess {
 protected:
  void Listen() {
    bus->Subscribe<navigation_t>("INS", 0, [this](const auto& m) { ins.push_back(m); });
    bus->Subscribe<position_fix_t>(
        "POSITION_FIX", 0, [this](const auto& m) { fixes.push_back(m); });
    bus->Subscribe<depth_t>("DEPTH", 0, [this](const auto& m) { depths.push_back(m); });
    bus->Subscribe<health_t>("HEALTH", 0, [this](const auto& m) { health = m; });
  }
  bool UntilText(const std::string& part) {
    return HandleUntil([&] { return health.text.find(part) != std::string::npos; }, 20'000);
  }
  std::vector<navigation_t> ins;
  std::vector<position_fix_t> fixes;
  std::vector<depth_t> depths;
  health_t health{};
};

TEST_F(NavProcess, WithNothingToReadItEndsWithOneLine) {
  const auto process =
      Start("seastitch-nav-driver", dir.Write("nav_driver.yaml", "needs_checksum: true\n"));
  EXPECT_EQ(process->Wait(), EX_CONFIG);
  EXPECT_THAT(process->Output(), HasSubstr("nav_driver.yaml: ins.source, gps.source"));
  EXPECT_EQ(process->Output().find('\n'), process->Output().size() - 1);
}

TEST_F(NavProcess, TheShippedConfigurationCanBeUsed) {
  Process process(Program("seastitch-nav-driver"),
                  {"--config", ConfigFile("nav_driver.yaml"), "--check-config"},
                  (dir.path() / "out.txt").string());
  EXPECT_EQ(process.Wait(), EXIT_SUCCESS) << process.Output();
}

// An INS on the network, GPS and pressure sensor on one serial line.
TEST_F(NavProcess, SentencesOverUdpAndASerialLineBecomeMessages) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  Listen();
  const std::filesystem::path link = dir.path() / "gps";
  const SerialLine line(link);
  const int port = FreeUdpPort();
  const std::string serial = "\"serial:" + link.string() + "?baud=19200\"";
  const auto process = Start("seastitch-nav-driver",
                             dir.Write("nav_driver.yaml",
                                       "ins: {source: \"udp:127.0.0.1:" + std::to_string(port) +
                                           "\", clock: device}\ngps: {source: " + serial +
                                           ", clock: device}\ndepth: {source: " + serial + "}\n"));
  ASSERT_TRUE(UntilText("waiting for ins at udp:127.0.0.1")) << process->Output();
  EXPECT_EQ(line.rate(), static_cast<speed_t>(B19200));
  const std::string ins_text = "$PRDID,-1.50,2.00,275.25*55\r\n" + std::string(kGga);
  UdpSender(port).Send({ins_text.begin(), ins_text.end()});
  line.Send("23,junk\r\n" + std::string(kGga).substr(0, 30));
  line.Send(std::string(kGga).substr(30) + "0009.996,M\r\n");
  EXPECT_TRUE(HandleUntil(
      [&] { return ins.size() == 2 && fixes.size() == 1 && depths.size() == 1; }, 20'000))
      << ins.size() << " " << fixes.size() << " " << depths.size() << process->Output();
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].source, "gps");
  EXPECT_NEAR(fixes[0].latitude_rad, 57.5020576 * M_PI / 180.0, 1e-11);
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_EQ(depths[0].depth_m, 9.996);
  EXPECT_TRUE(HandleUntil([&] { return health.state == health_t::STATE_OK; }, 20'000))
      << health.text;
  EXPECT_EQ(health.process, "nav-driver");
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// Frames of an INS behind a gateway, with those of another device in between, and from a log.
TEST_F(NavProcess, AnInsOnCanIsReadFromAGatewayAndFromALog) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  Listen();
  std::filesystem::copy_file(ConfigFile("sbg_ecan.dbc"), dir.path() / "sbg_ecan.dbc");
  const auto config = [this](const std::string& source) {
    return dir.Write("nav_driver.yaml",
                     "ins: {source: \"" + source + "\", format: sbg_ecan, clock: receive}\n");
  };
  const int port = FreeUdpPort();
  auto process = Start("seastitch-nav-driver", config("udp:127.0.0.1:" + std::to_string(port)));
  ASSERT_TRUE(UntilText("waiting for ins at udp:127.0.0.1")) << process->Output();
  const UdpSender gateway(port);
  for (int i = 0; i < 10; ++i) gateway.Send(EncodeCannelloni(EcanFrames(i), 0));
  EXPECT_TRUE(HandleUntil([&] { return ins.size() == 9; }, 20'000)) << ins.size();
  EXPECT_TRUE(HandleUntil([&] { return health.state == health_t::STATE_OK; }, 20'000))
      << health.text;
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
  for (std::size_t i = 0; i < ins.size(); ++i)
    EXPECT_EQ(ins[i].v_ned_mps[0], 0.25 * static_cast<double>(i));

  std::string log;
  for (int i = 0; i < 200; ++i)
    for (const CanFrame& frame : EcanFrames(i))
      log +=
          FormatCandumpLine({FromUtime(1'700'000'000'000'000 + 20'000 * i), "can0", frame}) + "\n";
  ins.clear();
  process =
      Start("seastitch-nav-driver", config("candump:" + dir.Write("ins.log", log) + "?speed=8"));
  EXPECT_TRUE(HandleUntil([&] { return ins.size() == 199; }, 20'000)) << ins.size();
  EXPECT_EQ(process->Wait(), EXIT_SUCCESS) << process->Output();
  for (std::size_t i = 0; i < ins.size(); ++i) {
    ASSERT_EQ(ins[i].utime, 1'700'000'000'000'000 + 20'000 * static_cast<std::int64_t>(i));
    ASSERT_EQ(ins[i].v_ned_mps[0], 0.25 * static_cast<double>(i % 100));
  }
}

TEST_F(NavProcess, ASerialPortThatIsMissingOrUnpluggedIsNamedAndTakenAgain) {
  if (!OpenBus()) {
    GTEST_SKIP() << "LCM cannot open " << lcm_url;
  }
  Listen();
  const std::filesystem::path link = dir.path() / "gps";
  const auto process =
      Start("seastitch-nav-driver",
            dir.Write("nav_driver.yaml",
                      "gps: {source: \"serial:" + link.string() + "\", interval_s: 0}\n"));
  ASSERT_TRUE(UntilText("cannot open the port: No such file")) << health.text << process->Output();
  SerialLine line(link);
  ASSERT_TRUE(
      HandleUntil([&] { return health.text.find("cannot open") == std::string::npos; }, 20'000));
  line.Send(kNoFix);
  EXPECT_TRUE(HandleUntil([&] { return health.state == health_t::STATE_OK; }, 20'000))
      << health.text;
  line.Unplug();
  EXPECT_TRUE(UntilText("cannot be used")) << health.text;
  line.Plug();
  ASSERT_TRUE(HandleUntil([&] { return health.text.find("cannot") == std::string::npos; }, 20'000))
      << health.text;
  line.Send(kGga);
  EXPECT_TRUE(HandleUntil([&] { return fixes.size() == 1; }, 20'000)) << process->Output();
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

}  // namespace
}  // namespace seastitch
