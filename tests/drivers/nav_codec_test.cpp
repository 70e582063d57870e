// Instruments of navigation: what their bytes become.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "common/core/pose.hpp"
#include "drivers/nav/depth_codec.hpp"
#include "drivers/nav/ins_frames.hpp"
#include "drivers/nav/nmea_fixes.hpp"
#include "drivers/nav/nmea_ins.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;
using testing::Pair;

constexpr std::int64_t kDay = 1'714'608'000'000'000;  // 2024-05-02
constexpr std::int64_t kNoon = kDay + 43'200'000'000;

// "$BODY*hh" and a line end; the sum is the test's own.
std::string Line(const std::string& body) {
  int sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  char text[8];
  std::snprintf(text, sizeof text, "*%02X\r\n", sum);
  return "$" + body + text;
}

std::string Gga(const std::string& time, int quality = 4, const std::string& hdop = "0.8") {
  return Line("GPGGA," + time + ",5730.000000,N,01115.000000,E," + std::to_string(quality) +
              ",14," + hdop + ",3.25,M,40.50,M,,");
}

std::vector<NavOutput> Feed(NavCodec* codec, const std::string& text, std::int64_t utime) {
  return codec->Add(std::vector<std::uint8_t>(text.begin(), text.end()), FromUtime(utime));
}

template <class T>
std::vector<T> All(const std::vector<NavOutput>& outputs) {
  std::vector<T> all;
  for (const NavOutput& output : outputs)
    if (const auto* one = std::get_if<T>(&output)) all.push_back(*one);
  return all;
}

Eigen::Vector3d RpyDeg(const Attitude& attitude) {
  return RpyFromRotation(attitude.q_ned_imu.toRotationMatrix()) * Rad2Deg(1.0);
}

// --- INS -----------------------------------------------------------------------------------------

NmeaInsParams Ins(DeviceClock clock = DeviceClock::kDevice) {
  NmeaInsParams params;
  params.clock.clock = clock;
  return params;
}

TEST(NmeaIns, PositionVelocityAndAttitudeAreSamplesWithTheirOwnTimes) {
  NmeaIns ins(Ins());
  const auto samples = All<NavigationSample>(
      Feed(&ins,
           Line("GPVTG,90.0,T,,M,4.86,N,9.00,K,D") + Gga("120000.00") +
               Line("PASHR,120000.250,275.25,T,+2.00,-1.50,+0.25,0.020,0.021,0.050,2,1"),
           kNoon + 300'000));
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(ToUtime(samples[0].time), kNoon);
  EXPECT_EQ(samples[0].status, InsStatus::kAided);
  ASSERT_TRUE(samples[0].position && samples[0].velocity && samples[0].height);
  EXPECT_NEAR(Rad2Deg(samples[0].position->latitude_rad), 57.5, 1e-9);
  EXPECT_NEAR(samples[0].velocity->v_ned_mps.y(), 2.5, 1e-3);
  EXPECT_NEAR(samples[0].velocity->v_ned_mps.x(), 0.0, 1e-9);
  EXPECT_EQ(samples[0].height->value_m, 43.75);
  EXPECT_FALSE(samples[0].attitude);
  EXPECT_EQ(ToUtime(samples[1].time), kNoon + 250'000);
  ASSERT_TRUE(samples[1].attitude);
  EXPECT_TRUE(RpyDeg(*samples[1].attitude).isApprox(Eigen::Vector3d(2.0, -1.5, -84.75), 1e-9));
  EXPECT_NEAR(Rad2Deg(samples[1].attitude->sigma_rpy_rad.z()), 0.05, 1e-12);
}

TEST(NmeaIns, ADoubledPositionOfTwoSentencesIsOne) {
  NmeaIns ins(Ins());
  const std::string rmc = Line("GNRMC,120000.00,A,5730.0,N,01115.0,E,4.86,90.0,020524,,,D");
  const auto samples =
      All<NavigationSample>(Feed(&ins, Gga("120000.00") + rmc + Gga("120001.00") + rmc, kNoon));
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_FALSE(samples[0].velocity);
  EXPECT_TRUE(samples[1].velocity) << "RMC gave the velocity all the same";
  // Alone it is the position.
  NmeaIns other(Ins());
  const auto alone = All<NavigationSample>(Feed(&other, rmc, kNoon));
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_TRUE(alone[0].position);
}

TEST(NmeaIns, OneAttitudeOfSeveralTheOtherWhenItFallsSilent) {
  NmeaIns ins(Ins());
  const std::string prdid = Line("PRDID,-1.50,2.00,275.25");
  const std::string psxn = Line("PSXN,23,2.00,-1.50,275.25,0.25");
  EXPECT_EQ(Feed(&ins, prdid, kNoon).size(), 1u);
  EXPECT_EQ(Feed(&ins, psxn, kNoon + 100'000).size(), 0u);
  EXPECT_EQ(Feed(&ins, prdid, kNoon + 1'000'000).size(), 1u);
  EXPECT_EQ(Feed(&ins, psxn, kNoon + 4'000'000).size(), 1u) << "the first has fallen silent";
  EXPECT_EQ(ins.counters().at("attitude_not_used"), 1);
}

TEST(NmeaIns, AttitudeWithoutAHeadingTakesThatOfTheGyro) {
  NmeaIns ins(Ins());
  const std::string tilt = Line("PRDID,-1.50,2.00,");
  EXPECT_TRUE(Feed(&ins, tilt, kNoon).empty());
  EXPECT_EQ(ins.counters().at("attitude_without_heading"), 1);
  Feed(&ins, Line("HEHDT,100.0,T"), kNoon + 200'000);
  const auto samples = All<NavigationSample>(Feed(&ins, tilt, kNoon + 300'000));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_NEAR(RpyDeg(*samples[0].attitude).z(), 100.0, 1e-9);
  EXPECT_EQ(ToUtime(samples[0].time), kNoon + 300'000) << "it states no time";
  EXPECT_TRUE(Feed(&ins, tilt, kNoon + 5'000'000).empty()) << "an old heading is none";
}

TEST(NmeaIns, AHeadingAloneIsNoAttitudeAndIsCounted) {
  NmeaIns ins(Ins());
  EXPECT_TRUE(Feed(&ins, Line("HEHDT,100.0,T"), kNoon).empty());
  EXPECT_EQ(ins.counters().at("heading_without_tilt"), 1);
}

TEST(NmeaIns, WhatItCallsInvalidIsInvalid) {
  NmeaIns ins(Ins());
  auto samples = All<NavigationSample>(
      Feed(&ins, Line("PSXN,20,0,0,2,0") + Line("PSXN,23,2.0,-1.5,275.0,0.2"), kNoon));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0].status, InsStatus::kInvalid);
  samples = All<NavigationSample>(Feed(&ins, Gga("120001.00", 0) + Gga("120002.00", 6), kNoon));
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0].status, InsStatus::kInvalid);
  EXPECT_FALSE(samples[0].position);
  EXPECT_EQ(samples[1].status, InsStatus::kDeadReckoning);
}

TEST(NmeaIns, SignsOfAMakerWhoCountsThemTheOtherWay) {
  NmeaInsParams params = Ins();
  params.invert_roll = params.invert_pitch = true;
  NmeaIns ins(params);
  const auto samples = All<NavigationSample>(Feed(&ins, Line("PRDID,-1.50,2.00,275.25"), kNoon));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_TRUE(RpyDeg(*samples[0].attitude).isApprox(Eigen::Vector3d(-2.0, 1.5, -84.75), 1e-9));
}

// --- days and clocks -----------------------------------------------------------------------------

TEST(DayClock, TheDayIsThatNearestToTheReceiveStamp) {
  NmeaIns ins(Ins());
  const auto before = All<NavigationSample>(Feed(&ins, Gga("235959.90"), kDay + 100'000));
  EXPECT_EQ(ToUtime(before.at(0).time), kDay - 100'000);
  const auto after = All<NavigationSample>(Feed(&ins, Gga("000000.10"), kDay - 50'000));
  EXPECT_EQ(ToUtime(after.at(0).time), kDay + 100'000);
}

TEST(DayClock, ADateThatIsStatedHoldsWhereTheComputersIsWrong) {
  NmeaIns ins(Ins());
  constexpr std::int64_t kWrong = 1'000'000'000;  // a computer in 1970
  Feed(&ins, Line("GPZDA,235950.00,01,05,2024,00,00"), kWrong);
  const auto samples = All<NavigationSample>(Feed(&ins, Gga("000005.00"), kWrong + 15'000'000));
  EXPECT_EQ(ToUtime(samples.at(0).time), kDay + 5'000'000) << "past midnight";
}

TEST(DayClock, WithTheReceiveClockTheInstrumentsTimeDoesNotMatter) {
  NmeaInsParams params = Ins(DeviceClock::kReceive);
  params.clock.latency_s = 0.2;
  NmeaIns ins(params);
  const auto samples = All<NavigationSample>(Feed(&ins, Gga("010203.00"), kNoon));
  EXPECT_EQ(ToUtime(samples.at(0).time), kNoon - 200'000);
}

// --- binary frames -------------------------------------------------------------------------------

std::filesystem::path Golden(const std::string& name) { return Shared("vectors/survey/" + name); }

TEST(PhinsIns, AFrameIsASampleAndItsPressureSensorADepth) {
  SKIP_WITHOUT(Golden("phins/synthetic_v3.bin"));
  const auto frame = BytesOf(Golden("phins/synthetic_v3.bin"));
  PhinsIns ins({.clock = {DeviceClock::kDevice}});
  constexpr std::int64_t kWrong =
      1'000'000'000;  // the computer's day does not matter: it has a date
  const auto outputs = ins.Add(frame, FromUtime(kWrong));
  const auto samples = All<NavigationSample>(outputs);
  const auto depths = All<DepthSample>(outputs);
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(ToUtime(samples[0].time), kDay + 37'232'015'000);
  EXPECT_EQ(samples[0].source, "phins");
  EXPECT_EQ(samples[0].height->value_m, 35.75);
  EXPECT_FALSE(samples[0].depth);
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_EQ(depths[0].depth_m, 12.5);
  EXPECT_EQ(ToUtime(depths[0].time), kDay + 37'232'005'000);
  EXPECT_TRUE(All<DepthSample>(ins.Add(frame, FromUtime(kWrong + 1))).empty()) << "the same depth";
  EXPECT_EQ(ins.messages(), 2);
}

TEST(PhinsIns, UnderWaterItsAltitudeMayBeItsDepth) {
  SKIP_WITHOUT(Golden("phins/real_stdv5.bin"));
  PhinsIns ins({.clock = {DeviceClock::kReceive}, .altitude_is_depth = true});
  const auto frame = BytesOf(Golden("phins/real_stdv5.bin"));
  const auto samples = All<NavigationSample>(ins.Add(frame, FromUtime(kNoon)));
  ASSERT_EQ(samples.size(), 1u);
  const auto golden = ReadJson(Golden("phins/real.json"))["real_stdv5.bin"];
  EXPECT_EQ(samples[0].depth->value_m, -golden["position"]["alt"].get<double>());
  EXPECT_EQ(samples[0].depth->sigma_m, golden["position_sd"]["alt"]);
  EXPECT_EQ(samples[0].status, InsStatus::kAligning);
  EXPECT_EQ(ToUtime(samples[0].time), kNoon);
}

TEST(KmBinaryIns, ADatagramIsASampleByItsOwnTime) {
  SKIP_WITHOUT(Golden("nav/synthetic_kmb.bin"));
  KmBinaryIns ins({DeviceClock::kDevice});
  const auto samples =
      All<NavigationSample>(ins.Add(BytesOf(Golden("nav/synthetic_kmb.bin")), FromUtime(kNoon)));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(ToUtime(samples[0].time), 1'714'645'232'015'000);
  EXPECT_TRUE(samples[0].position && samples[0].attitude && samples[0].velocity);
  EXPECT_EQ(samples[0].source, "kmb");
}

// A sonar's #SKM over UDP, with noise before it and a #KMB of the sensor after it.
TEST(KmBinaryIns, EverySampleOfAnSkmIsASample) {
  SKIP_WITHOUT(Golden("nav/synthetic_kmb.bin"));
  std::vector<NavigationRecord> records(3);
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].time = FromUtime(kNoon + 10'000 * static_cast<std::int64_t>(i));
    records[i].attitude = Attitude{};
    records[i].position = GeoPosition{1.0, 0.1};
  }
  std::vector<std::uint8_t> stream{'n', 'o', 'i', 's', 'e'};
  for (const auto& part :
       {EncodeSkm(records, KmallHeader{}), BytesOf(Golden("nav/synthetic_kmb.bin"))})
    stream.insert(stream.end(), part.begin(), part.end());
  KmBinaryIns ins({DeviceClock::kDevice});
  const auto samples = All<NavigationSample>(ins.Add(stream, FromUtime(kNoon)));
  ASSERT_EQ(samples.size(), 4u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(samples[i].time, records[i].time);
  EXPECT_NEAR(samples[2].position->latitude_rad, 1.0, 1e-9);
  EXPECT_EQ(ins.counters(), (Counters{{"skipped_bytes", 5}}));
}

TEST(InsFrames, AnotherProtocolIsSaid) {
  PhinsIns phins({});
  EXPECT_TRUE(Feed(&phins, Gga("120000.00"), kNoon).empty());
  EXPECT_EQ(phins.messages(), 0);
  EXPECT_EQ(phins.unused_messages(), "bytes that are no frames (another protocol?)");
}

// --- fixes ---------------------------------------------------------------------------------------

NmeaFixParams Gps() {
  NmeaFixParams params;
  params.source = "gps";
  params.clock.clock = DeviceClock::kDevice;
  return params;
}
NmeaFixParams Usbl() {
  NmeaFixParams params = Gps();
  params.source = "usbl";
  params.sigma_m = 5.0;
  return params;
}
std::string Ssb(const std::string& time,
                const std::string& transponder,
                const std::string& error = "",
                const std::string& accuracy = "0.5") {
  return Line("PSIMSSB," + time + "," + transponder + ",A," + error +
              ",R,N,F,1.003564311,0.196349541,134.10," + accuracy + ",N,,");
}

TEST(NmeaFixes, SigmaGrowsWithTheDilution) {
  NmeaFixes gps(Gps());
  const auto fixes =
      All<PositionFix>(Feed(&gps, Gga("120000.00", 1, "0.7") + Gga("120001.00", 1, "20.0"), kNoon));
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(ToUtime(fixes[0].time), kNoon);
  EXPECT_EQ(fixes[0].source, "gps");
  EXPECT_NEAR(Rad2Deg(fixes[0].longitude_rad), 11.25, 1e-9);
  EXPECT_DOUBLE_EQ(fixes[0].covariance_north_east_m2(0, 0), 9.0);
  EXPECT_DOUBLE_EQ(fixes[1].covariance_north_east_m2(1, 1), 3600.0);
  EXPECT_EQ(fixes[1].covariance_north_east_m2(0, 1), 0.0);
}

// A receiver under water, one that reckons itself, one that simulates.
TEST(NmeaFixes, WhatIsNoMeasurementIsNoFix) {
  NmeaFixes gps(Gps());
  EXPECT_TRUE(Feed(&gps,
                   Line("GPGGA,120000.00,,,,,0,00,,,M,,M,,") + Gga("120001.00", 6) +
                       Gga("120002.00", 7) + Gga("120003.00", 8),
                   kNoon)
                  .empty());
  EXPECT_THAT(gps.counters(), ElementsAre(Pair("no_position", 1), Pair("not_measured", 3)));
  EXPECT_EQ(gps.messages(), 4) << "it is alive";
}

// A switch that doubles datagrams, and a receiver at 10 Hz, whose errors are one.
TEST(NmeaFixes, TheSameFixTwiceCountsOnce) {
  NmeaFixes gps(Gps());
  std::string burst;
  for (const char* time : {"120000.00", "120000.00", "120000.10", "120000.90", "120001.00"})
    burst += Gga(time);
  EXPECT_EQ(All<PositionFix>(Feed(&gps, burst, kNoon)).size(), 2u);
  EXPECT_EQ(gps.counters().at("too_soon"), 3);
  // Its clock was set back by an hour: the fixes go on.
  EXPECT_EQ(All<PositionFix>(Feed(&gps, Gga("110000.00"), kNoon)).size(), 1u);
}

TEST(NmeaFixes, PositionsOfAnotherVehicleMoveNothing) {
  NmeaFixes usbl(Usbl());
  const auto fixes = All<PositionFix>(Feed(
      &usbl, Ssb("120000.00", "B01") + Ssb("120002.00", "B02") + Ssb("120004.00", "B01"), kNoon));
  EXPECT_EQ(fixes.size(), 2u);
  EXPECT_EQ(usbl.counters().at("other_transponder"), 1);
  NmeaFixParams named = Usbl();
  named.transponder = "B02";
  NmeaFixes second(named);
  EXPECT_EQ(Feed(&second, Ssb("120000.00", "B01") + Ssb("120002.00", "B02"), kNoon).size(), 1u);
}

TEST(NmeaFixes, AnAcousticFixIsAsGoodAsItsSystemAndItsErrorSay) {
  NmeaFixes usbl(Usbl());
  const auto fixes =
      All<PositionFix>(Feed(&usbl,
                            Ssb("120000.00", "B01") + Ssb("120002.00", "B01", "", "12.0") +
                                Ssb("120004.00", "B01", "VRU"),
                            kNoon));
  ASSERT_EQ(fixes.size(), 3u);
  EXPECT_DOUBLE_EQ(fixes[0].covariance_north_east_m2(0, 0), 25.0);
  EXPECT_DOUBLE_EQ(fixes[1].covariance_north_east_m2(0, 0), 144.0);
  EXPECT_DOUBLE_EQ(fixes[2].covariance_north_east_m2(0, 0), 225.0) << "its maker doubts it";
}

TEST(NmeaFixes, APositionAsSeenFromTheShipIsCountedNotGuessed) {
  NmeaFixes usbl(Usbl());
  EXPECT_TRUE(Feed(&usbl,
                   Line("PSIMSSB,102030.50,B01,A,,C,H,M,-61.300,39.017,134.026,0.072,T,0.050576,") +
                       Line("PSIMSSB,102032.50,B01,V,NRy,C,H,M,,,,,N,,"),
                   kNoon)
                  .empty());
  EXPECT_THAT(usbl.counters(), ElementsAre(Pair("no_position", 1), Pair("not_absolute", 1)));
}

// --- depth ---------------------------------------------------------------------------------------

DepthCodecParams Pressure(PressureUnit unit, double air_pressure_pa) {
  DepthCodecParams params;
  params.clock = {DeviceClock::kReceive, 0.1};
  params.unit = unit;
  params.air_pressure_pa = air_pressure_pa;
  return params;
}

TEST(DepthCodec, APressureBecomesADepth) {
  // 14.696 psi of air and 100 m of water of 1025 kg/m3: 100 * 1025 * 9.80665 Pa = 145.789 psi.
  DepthCodec absolute(Pressure(PressureUnit::kPsi, 101'325.0));
  auto depths = All<DepthSample>(Feed(&absolute, "*0001160.4848\r\n", kNoon));
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_NEAR(depths[0].depth_m, 100.0, 0.002);
  EXPECT_NEAR(*depths[0].pressure_pa, 1'005'181.6, 20.0);
  EXPECT_EQ(ToUtime(depths[0].time), kNoon - 100'000);
  // A sensor that was set to zero at the surface.
  DepthCodec gauge(Pressure(PressureUnit::kDecibar, 0.0));
  depths = All<DepthSample>(Feed(&gauge, "100.5182,dBar\r\n", kNoon));
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_NEAR(depths[0].depth_m, 100.0, 0.002);
}

TEST(DepthCodec, DepthsComeAsTheyAre) {
  DepthCodec codec(Pressure(PressureUnit::kDecibar, 101'325.0));
  const auto depths = All<DepthSample>(
      Feed(&codec,
           Line("SDDBS,41.0,f,12.50,M,6.8,F") + "0009.996,M\r\n" + Line("PIPS,0001.00,M"),
           kNoon));
  ASSERT_EQ(depths.size(), 3u);
  EXPECT_EQ(depths[0].depth_m, 12.5);
  EXPECT_EQ(depths[1].depth_m, 9.996);
  EXPECT_EQ(depths[2].depth_m, 1.0);
  EXPECT_FALSE(depths[0].pressure_pa);
}

// The unit in the configuration is not that of the sensor.
TEST(DepthCodec, WhatNoSeaHoldsIsCountedNotGiven) {
  DepthCodec codec(Pressure(PressureUnit::kMegapascal, 101'325.0));
  EXPECT_TRUE(Feed(&codec, "*0001160.4848\r\n", kNoon).empty());
  EXPECT_EQ(codec.counters().at("implausible"), 1);
}

// --- wiring --------------------------------------------------------------------------------------

TEST(NmeaCodec, WhatComesInsteadIsNamed) {
  NmeaFixes gps(Gps());
  Feed(&gps, Line("GPGSV,1,1,00") + Line("GPGLL,5730.0,N,01115.0,E,120000,A"), kNoon);
  EXPECT_EQ(gps.unused_messages(), "GLL, GSV");
  EXPECT_EQ(gps.messages(), 0);
  NmeaFixes wrong_rate(Gps());
  Feed(&wrong_rate, "\x80\x12xx\r\n\xff\xfe\r\n", kNoon);
  EXPECT_EQ(wrong_rate.unused_messages(), "bytes that are no sentences (the baud rate?)");
}

}  // namespace
}  // namespace seastitch
