// The sentences of seastitch-nav-output: when, with what quality, and what its file may say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/core/pose.hpp"
#include "common/runtime/config/config.hpp"
#include "drivers/output/byte_sink.hpp"
#include "drivers/output/nav_output_node.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

NavState StateAt(double time_s, double sigma_m = 1.0) {
  NavState state;
  state.time = FromUtime(1'772'368'496'000'000) + FromSeconds(time_s);
  state.T_map_vehicle.translation() = Eigen::Vector3d(100.0, 50.0, 30.0);
  state.covariance.topLeftCorner<2, 2>() = 0.5 * sigma_m * sigma_m * Eigen::Matrix2d::Identity();
  return state;
}

std::size_t CountOf(const std::string& type, const std::string& lines) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = lines.find("$IN" + type, at)) != std::string::npos; ++at) ++n;
  return n;
}

TEST(NavSentences, EachHasItsRate) {
  NavSentencesParams params;
  params.zda_hz = 0.0;
  NavSentences sentences(params, MapFrame({43.0, -70.0}));
  std::string lines;
  for (int i = 0; i < 200; ++i) lines += sentences.Add(StateAt(0.05 * i), 10.0);  // 20 Hz for 10 s
  EXPECT_EQ(CountOf("GGA", lines), 50u);
  EXPECT_EQ(CountOf("RMC", lines), 50u);
  EXPECT_EQ(CountOf("GST", lines), 10u);
  EXPECT_EQ(CountOf("HDT", lines), 100u);
  EXPECT_EQ(CountOf("VTG", lines), 50u);
  EXPECT_EQ(CountOf("DPT", lines), 10u);
  EXPECT_EQ(CountOf("ZDA", lines), 0u);
  EXPECT_LE(static_cast<double>(lines.size()), 10.0 * BytesPerSecondOf(params));
}

TEST(NavSentences, NoStepOfTheClockDelaysThem) {
  NavSentences sentences({}, MapFrame({43.0, -70.0}));
  sentences.Add(StateAt(0.0), {});
  for (const double time_s : {-86'400.0, 1e6, 5.0})
    EXPECT_EQ(CountOf("GGA", sentences.Add(StateAt(time_s), {})), 1u) << time_s;
}

TEST(NavSentences, QualityIsThatOfTheSigma) {
  NavSentencesParams params;
  params.gga_hz = 20.0;
  NavSentences sentences(params, MapFrame({43.0, -70.0}));
  EXPECT_THAT(sentences.Add(StateAt(0.0, 9.9), {}), HasSubstr(",W,1,12,2.3,-30.00,M"));
  EXPECT_TRUE(sentences.has_position());
  EXPECT_THAT(sentences.Add(StateAt(0.1, 10.1), {}), HasSubstr(",W,6,12,2.4,-30.00,M"));
  const std::string unknown = sentences.Add(StateAt(1.2, 301.0), {});
  EXPECT_THAT(unknown, HasSubstr(",,,,,0,00,,,M"));
  EXPECT_FALSE(sentences.has_position());
  EXPECT_EQ(CountOf("GST", unknown), 0u);
  EXPECT_EQ(CountOf("HDT", unknown), 1u) << "the heading is known";
}

TEST(NavOutputConfig, TheShippedFileIsReadAndNamesNoOutput) {
  EXPECT_TRUE(LoadNavOutputConfig(ConfigFile("nav_output.yaml")).outputs().empty());
}

TEST(NavOutputConfig, MistakesAreNamedByFileKeyAndWhatWasExpected) {
  const TemporaryDir dir;
  const std::string vehicle = "vehicle: " + ConfigFile("vehicle.yaml") + "\n";
  const std::pair<const char*, const char*> mistakes[] = {
      {"udp: 127.0.0.1:10110", "nav_output.yaml: udp: 127.0.0.1:10110: expected udp:HOST:PORT or"},
      {"udp: \"udp:127.0.0.1:99999\"", "is not a port"},
      {"udp: \"serial:/dev/ttyS0\"", "nav_output.yaml: udp: serial:/dev/ttyS0: expected udp:"},
      {"serial: \"tcp:127.0.0.1:1\"", "expected udp:HOST:PORT or serial:/dev/NAME"},
      {"serial: \"serial:/dev/ttyS0\"", "a second, and the port takes 480: expected a higher baud"},
      {"serial: \"serial:/dev/ttyS0?baud=77\"", "is not a rate of a serial port"},
      {"talker: gp", "talker: 'gp' is not two capital letters"},
      {"navigation: INS", "navigation"},
      {"rates: {gga_hz: 51}", "rates.gga_hz"},
      {"fix_sigma: 1", "unknown key; did you mean 'fix_sigma_m'"}};
  for (const auto& [text, expected] : mistakes) {
    try {
      LoadNavOutputConfig(dir.Write("nav_output.yaml", vehicle + text + "\n"));
      ADD_FAILURE() << text;
    } catch (const ConfigError& e) {
      EXPECT_THAT(e.what(), HasSubstr(expected)) << text;
    }
  }
  const std::string usable = "serial: \"serial:/dev/ttyS0?baud=38400\"\n";
  EXPECT_EQ(LoadNavOutputConfig(dir.Write("nav_output.yaml", vehicle + usable)).outputs().size(),
            1u);
}

// A datagram that the kernel refuses loses the socket; it is opened again within two seconds.
TEST(UdpSink, IsOpenedAgainAfterAnError) {
  const auto sink = OpenByteSink("udp:127.0.0.1:9");
  sink->Send(std::string(70'000, 'x'));
  EXPECT_NE(sink->trouble(), "");
  EXPECT_EQ(sink->counters().at("udp_send_errors"), 1);
  for (int i = 0; i < 40 && !sink->trouble().empty(); ++i) {
    usleep(50'000);
    sink->Send("short\r\n");
  }
  EXPECT_EQ(sink->trouble(), "");
  EXPECT_EQ(sink->counters().at("udp_send_errors"), 1);
}

}  // namespace
}  // namespace seastitch
