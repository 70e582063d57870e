// Bytes of navigation instruments, decoded once more from a log.
#include "survey/read/raw_replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/convert/convert.hpp"
#include "seastitch/navigation_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

LogEvent Raw(const std::string& source, const std::string& text, std::int64_t utime) {
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  const auto parts = ToRawParts(bytes, source, FromUtime(utime), 0);
  LogEvent event;
  event.utime = utime;
  event.channel = "RAW_NAV";
  event.data.resize(static_cast<std::size_t>(parts.at(0).getEncodedSize()));
  parts[0].encode(event.data.data(), 0, static_cast<int>(event.data.size()));
  return event;
}

// The roll was taken for the wrong sign on the dive, and a GPS receiver was on another port.
TEST(RawReplay, OfNavigationInstrumentsGoesByTheSourcesOfTheirBytes) {
  const TemporaryDir dir;
  DriverFiles files;
  files.nav = dir.Write("nav_driver.yaml",
                        "ins: {source: \"udp:0.0.0.0:8001\", clock: receive, invert_roll: true}\n"
                        "gps: {source: \"serial:/dev/ttyS0\", clock: receive}\n");
  const RawSources sources({"RAW_NAV/udp:0.0.0.0:8001", "HEALTH/mapper"});
  EXPECT_TRUE(sources.nav);
  EXPECT_FALSE(sources.mbes);
  RawReplay replay(sources, files);
  EXPECT_FALSE(replay.MakesAnew("INS")) << "before its first bytes";
  constexpr std::int64_t kTime = 1'714'645'230'500'000;
  replay.Add(Raw("udp:0.0.0.0:8001", "$PRDID,-1.50,2.00,275.25*55\r\n", kTime));
  replay.Add(
      Raw("serial:/dev/ttyS0",
          "$GPGGA,102030.50,5730.123456,N,01115.654321,E,4,14,0.8,3.25,M,40.50,M,1.2,0123*4C\r\n",
          kTime));
  replay.Add(Raw("udp:0.0.0.0:9999", "$PRDID,-1.50,2.00,275.25*55\r\n", kTime));
  replay.Finish();
  std::vector<NavigationSample> ins;
  int fixes = 0;
  while (const auto received = replay.Take()) {
    if (const auto* sample = std::get_if<NavigationSample>(&received->sample))
      ins.push_back(*sample);
    fixes += std::holds_alternative<PositionFix>(received->sample) ? 1 : 0;
  }
  EXPECT_TRUE(replay.MakesAnew("INS"));
  EXPECT_FALSE(replay.MakesAnew("DVL"));
  ASSERT_EQ(ins.size(), 1u);
  ASSERT_TRUE(ins[0].attitude);
  EXPECT_NEAR(
      RpyFromRotation(ins[0].attitude->q_ned_imu.toRotationMatrix()).x(), Deg2Rad(-2.0), 1e-12);
  EXPECT_EQ(ins[0].time, FromUtime(kTime));
  EXPECT_EQ(fixes, 1);
}

}  // namespace
}  // namespace seastitch
