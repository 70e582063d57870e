// The driver of navigation instruments on a bus: messages, HEALTH, configuration.
#include "drivers/nav/nav_driver.hpp"
#include "common/runtime/config/parameter_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/convert/convert.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/navigation_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::int64_t kNoon = 1'714'651'200'000'000;
constexpr char kGga[] =
    "$GPGGA,102030.50,5730.123456,N,01115.654321,E,4,14,0.8,3.25,M,40.50,M,1.2,0123*4C\r\n";
constexpr char kPashr[] =
    "$PASHR,102030.500,275.25,T,+2.00,-1.50,+0.25,0.020,0.021,0.050,2,1*39\r\n";
constexpr char kDepth[] = "0009.996,M\r\n";
constexpr char kIns[] = "udp:0.0.0.0:8001";
constexpr char kShared[] = "serial:/dev/ttyS0?baud=9600";

class NavNode : public testing::Test {
 protected:
  NavNode() {
    bus.Subscribe<navigation_t>("INS", 0, [this](const auto& m) { ins.push_back(m); });
    bus.Subscribe<position_fix_t>("POSITION_FIX", 0, [this](const auto& m) { fixes.push_back(m); });
    bus.Subscribe<depth_t>("DEPTH", 0, [this](const auto& m) { depths.push_back(m); });
    bus.Subscribe<raw_bytes_t>("RAW_NAV", 0, [this](const auto& m) { raw.push_back(m); });
    config.ins.source = kIns;
    config.gps.source = config.depth.source = kShared;
    config.ins_nmea.clock.clock = DeviceClock::kDevice;
    config.gps_fixes.clock.clock = DeviceClock::kDevice;
  }
  void Feed(NavDriver* driver, const std::string& source, const std::string& text) {
    driver->Feed(source, {{text.begin(), text.end()}, FromUtime(kNoon), 0});
    bus.HandleAll();
  }

  NavDriverConfig config;
  Bus bus{"memq://"};
  BusOutput output{&bus};
  std::vector<navigation_t> ins;
  std::vector<position_fix_t> fixes;
  std::vector<depth_t> depths;
  std::vector<raw_bytes_t> raw;
  const NavDriver::Clock::time_point t0{};
};

TEST_F(NavNode, EachInstrumentReadsItsOwnSourceAndSeveralMayShareOne) {
  NavDriver driver(config, &output);
  Feed(&driver, kIns, std::string(kGga) + kPashr);
  Feed(&driver, kShared, std::string(kGga) + kDepth);
  ASSERT_EQ(ins.size(), 2u);
  EXPECT_TRUE(FromLcm(ins[0]));
  EXPECT_TRUE(FromLcm(ins[1])->attitude);
  EXPECT_EQ(ins[1].seq, 1);
  EXPECT_EQ(ins[0].recv_utime, kNoon);
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(FromLcm(fixes[0])->source, "gps");
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_EQ(depths[0].depth_m, 9.996);
  ASSERT_EQ(raw.size(), 2u);
  EXPECT_EQ(raw[0].source, kIns);
  EXPECT_EQ(raw[1].source, kShared);
  EXPECT_EQ(raw[1].seq, 1);
  EXPECT_EQ(raw[1].size, static_cast<int>(std::strlen(kGga) + std::strlen(kDepth)));
}

TEST_F(NavNode, HealthNamesWhoIsSilentAndWhatComesInstead) {
  NavDriver driver(config, &output);
  driver.UpdateHealth({}, t0);
  EXPECT_EQ(driver.health().state(), HealthState::kStarting);
  for (int s = 1; s <= 12; ++s) {
    Feed(&driver, kIns, kGga);
    Feed(&driver, kShared, std::string("$GPGLL,5730.0,N,01115.0,E,102030,A*2F\r\n") + kDepth);
    driver.UpdateHealth({}, t0 + seconds(s));
    if (s == 5) {
      EXPECT_EQ(driver.health().state(), HealthState::kOk);
    }
  }
  EXPECT_EQ(driver.health().state(), HealthState::kLost);
  EXPECT_THAT(driver.health().text(),
              HasSubstr("gps at serial:/dev/ttyS0?baud=9600 for 12 s, where it hears"));
  EXPECT_THAT(driver.health().text(), HasSubstr("GLL"));
  EXPECT_THAT(driver.health().text(),
              testing::Not(HasSubstr("depth at serial:/dev/ttyS0?baud=9600 for")));
  // Under water a receiver has no fix, and is alive.
  Feed(&driver, kShared, "$GPGGA,102031.00,5730.1234,S,01115.6543,W,0,00,,,M,,M,,*78\r\n");
  driver.UpdateHealth({}, t0 + seconds(13));
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
  EXPECT_EQ(driver.health().counter("gps_no_position"), 1);
  EXPECT_TRUE(fixes.empty());
}

TEST_F(NavNode, AnAcousticSystemMayBeSilent) {
  NavDriverConfig usbl;
  usbl.usbl.source = kIns;
  NavDriver driver(usbl, &output);
  for (const int s : {0, 5, 500}) driver.UpdateHealth({}, t0 + seconds(s));
  EXPECT_EQ(driver.health().state(), HealthState::kOk);
}

TEST_F(NavNode, TroubleOfASourceIsSaidWithItsName) {
  NavDriver driver(config, &output);
  Feed(&driver, kIns, kGga);
  driver.UpdateHealth({{kIns, {"", {3, "10.0.0.9, while 10.0.0.5 sends"}, {}}},
                       {kShared, {"No such file or directory", {}, {{"serial_lost", 1}}}}},
                      t0);
  EXPECT_THAT(driver.health().text(), HasSubstr(std::string(kShared) + ": No such file"));
  EXPECT_THAT(driver.health().text(),
              HasSubstr("3 so far, the last of udp:0.0.0.0:8001: 10.0.0.9"));
  EXPECT_EQ(driver.health().counter("serial_lost"), 1);
  driver.UpdateHealth({{kIns, {"", {3, ""}, {}}}, {kShared, {}}}, t0 + seconds(11));
  EXPECT_THAT(driver.health().text(), testing::Not(HasSubstr("sender")));
  EXPECT_THAT(driver.health().text(), testing::Not(HasSubstr("No such file")));
}

// --- an INS on CAN ------------------------------------------------------------------------------

CanFrame Frame(std::uint32_t id, const std::string& hex) {
  CanFrame frame;
  frame.id = id;
  frame.SetData(FromHex(hex));
  return frame;
}

NavDriverConfig OnCan(const TemporaryDir& dir, const std::string& source) {
  std::filesystem::copy_file(ConfigFile("sbg_ecan.dbc"), dir.path() / "sbg_ecan.dbc");
  return LoadNavDriverConfig(dir.Write("nav_driver.yaml",
                                       "ins: {source: \"" + source +
                                           "\", format: sbg_ecan, clock: receive}\n" +
                                           "gps: {source: \"" + kShared + "\"}\n"));
}

TEST_F(NavNode, AnInsOnCanHasPacketsOfFramesAsBytes) {
  const TemporaryDir dir;
  NavDriver driver(OnCan(dir, "can:can0"), &output);
  EXPECT_GT(driver.can_filters("can:can0").size(), 5u);
  EXPECT_TRUE(driver.can_filters(kShared).empty());
  const std::vector<CanFrame> frames{
      Frame(0x130, "15CD5B07"), Frame(0x134, "40CE6B232486C2F9"), Frame(0x130, "351B5C07")};
  const std::vector<std::uint8_t> packet = EncodeCannelloni(frames, 0);
  EXPECT_TRUE(driver.Feed("can:can0", {packet, FromUtime(kNoon), 0}));
  bus.HandleAll();
  ASSERT_EQ(ins.size(), 1u);
  EXPECT_NEAR(ins[0].latitude_rad, 59.4267712 * M_PI / 180.0, 1e-12);
  EXPECT_EQ(ins[0].utime, kNoon);
  ASSERT_EQ(raw.size(), 1u);
  EXPECT_EQ(raw[0].data, packet);
}

TEST_F(NavNode, TheControllerOfItsBusIsSaidWithItsName) {
  const TemporaryDir dir;
  NavDriver driver(OnCan(dir, "can:can0"), &output);
  driver.UpdateHealth({{"can:can0", {"", {}, {{"can_bus_off", 1}}, "controller is bus-off"}}}, t0);
  EXPECT_THAT(driver.health().text(), HasSubstr("can:can0: controller is bus-off"));
  EXPECT_EQ(driver.health().counter("can_bus_off"), 1);
  driver.UpdateHealth({{"can:can0", {}}}, t0);
  EXPECT_THAT(driver.health().text(), testing::Not(HasSubstr("controller")));
}

TEST_F(NavNode, TheFileOfItsIdsIsPublishedBesideTheConfiguration) {
  const TemporaryDir dir, replayed;
  const auto files = ConfigFiles(OnCan(dir, "can:can0"));
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].first, "sbg_ecan.dbc");
  for (const auto& [name, text] : files) replayed.Write(name, text);
  const NavDriverConfig again = LoadNavDriverConfig((replayed.path() / files[1].first).string());
  EXPECT_EQ(again.ins_signals.Filters().size(),
            NavDriver(again, &output).can_filters("can:can0").size());
  EXPECT_EQ(again.ins_dbc, (replayed.path() / "sbg_ecan.dbc").string());
  EXPECT_EQ(ConfigFiles(NavDriverConfig()).size(), 1u);
}

// --- configuration -------------------------------------------------------------------------------

class NavConfig : public testing::Test {
 protected:
  std::string ErrorOf(const std::string& text) {
    try {
      LoadNavDriverConfig(dir.Write("nav_driver.yaml", text));
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "";
  }
  const TemporaryDir dir;
};

TEST_F(NavConfig, TheShippedFileIsReadAndNamesNothing) {
  EXPECT_TRUE(LoadNavDriverConfig(ConfigFile("nav_driver.yaml")).sources().empty());
}

TEST_F(NavConfig, MistakesAreNamedByFileKeyAndWhatWasExpected) {
  EXPECT_THAT(ErrorOf("gps: {source: \"can:can0\"}"),
              HasSubstr("nav_driver.yaml: gps.source: can:can0: expected udp:HOST:PORT, "
                        "tcp:HOST:PORT or serial:/dev/NAME"));
  EXPECT_THAT(ErrorOf("gps: {source: \"serial:/dev/ttyUSB0?baud=4801\"}"),
              HasSubstr("gps.source: serial:/dev/ttyUSB0?baud=4801: '4801' is not a rate"));
  EXPECT_THAT(ErrorOf("gps: {source: \"serial:ttyUSB0\"}"), HasSubstr("expected serial:/dev/NAME"));
  EXPECT_THAT(ErrorOf("gps: {source: \"serial:/dev/ttyUSB0?parity=even\"}"),
              HasSubstr("unknown option 'parity=even'"));
  EXPECT_THAT(ErrorOf("depth: {clock: device}"), HasSubstr("depth.clock: 'device' is not receive"));
  EXPECT_THAT(ErrorOf("depth: {pressure_unit: torr}"), HasSubstr("depth.pressure_unit: 'torr'"));
  EXPECT_THAT(ErrorOf("ins: {format: sentences}"), HasSubstr("ins.format: 'sentences' is not"));
  EXPECT_THAT(ErrorOf("usbl: {sigma_m: 0}"), HasSubstr("usbl.sigma_m: '0' is not"));
  EXPECT_THAT(ErrorOf("ins: {source: \"serial:/dev/ttyUSB0\", format: sbg_ecan}"),
              HasSubstr("ins.source: serial:/dev/ttyUSB0: expected can:INTERFACE, candump:FILE"));
  EXPECT_THAT(ErrorOf("ins: {source: \"can:can0\", format: sbg_ecan, dbc: none.dbc}"),
              HasSubstr("nav_driver.yaml: ins.dbc: "));
  dir.Write("other.dbc", "BO_ 304 EKF_INFO: 4 X\n SG_ TIME_STAMP : 0|32@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_THAT(ErrorOf("ins: {source: \"can:can0\", format: sbg_ecan, dbc: other.dbc}"),
              HasSubstr("ins.dbc: 'EKF_EULER.ROLL': no such message in the DBC file"));
  const std::string dbc = ", format: sbg_ecan, dbc: \"" + ConfigFile("sbg_ecan.dbc") + "\"}\n";
  EXPECT_EQ(ErrorOf("ins: {source: \"udp:0.0.0.0:20000\"" + dbc), "");
  EXPECT_THAT(
      ErrorOf("ins: {source: \"udp:0.0.0.0:20000\"" + dbc + "gps: {source: \"udp:0.0.0.0:20000\"}"),
      HasSubstr("gps.source: udp:0.0.0.0:20000: expected another than that of ins"));
  EXPECT_THAT(ErrorOf("sonar: {}"), HasSubstr("sonar: unknown key"));
}

}  // namespace
}  // namespace seastitch
