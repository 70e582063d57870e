// NMEA 0183 sentences that we send: the form by hand, the values back through the decoder.
#include "codecs/navigation/nmea0183_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

NmeaState State() {
  NmeaState state;
  state.time = FromUtime(1'772'368'496'789'999);  // 2026-03-01 12:34:56.789999
  state.position = GeoPoint{Deg2Rad(-43.07000001), Deg2Rad(-7.5)};
  state.covariance_ned = Eigen::Vector3d(9.0, 16.0, 0.01).asDiagonal();
  state.depth_m = 30.127;
  state.altitude_m = 12.3;
  state.v_north_east_mps = {0.0, -1.0};
  state.heading_rad = Deg2Rad(-90.0);
  state.quality = FixQuality::kAutonomous;
  return state;
}

TEST(NmeaWriter, HasTheFormOfTheStandard) {
  const NmeaWriter writer("IN");
  // Minutes, knots, and the checksums by a calculator.
  EXPECT_EQ(writer.Gga(State()),
            "$INGGA,123456.78,4304.200001,S,00730.000000,W,1,12,1.2,-30.13,M,,M,,*4D\r\n");
  EXPECT_EQ(writer.Rmc(State()),
            "$INRMC,123456.78,A,4304.200001,S,00730.000000,W,1.944,270.00,010326,,,A*76\r\n");
  EXPECT_EQ(writer.Gst(State()),
            "$INGST,123456.78,,4.000,3.000,90.00,3.000,4.000,0.100*69\r\n");
  EXPECT_EQ(writer.Hdt(State()), "$INHDT,270.00,T*10\r\n");
  EXPECT_EQ(writer.Vtg(State()), "$INVTG,270.00,T,,M,1.944,N,3.600,K,A*25\r\n");
  EXPECT_EQ(writer.Dpt(State()), "$INDPT,12.30,30.13*46\r\n");
  EXPECT_EQ(NmeaWriter("GP").Zda(State()), "$GPZDA,123456.78,01,03,2026,00,00*6A\r\n");
}

TEST(NmeaWriter, StatesWhatIsNotKnown) {
  NmeaState state = State();
  state.position.reset();
  state.altitude_m.reset();
  const NmeaWriter writer("IN");
  EXPECT_THAT(writer.Gga(state), testing::StartsWith("$INGGA,123456.78,,,,,0,00,,,M,,M,,*"));
  EXPECT_THAT(writer.Rmc(state), testing::StartsWith("$INRMC,123456.78,V,,,,,1.944,270.00,010326,,,N*"));
  EXPECT_EQ(writer.Gst(state), "");
  EXPECT_EQ(writer.Dpt(state), "");
  EXPECT_THAT(writer.Vtg(state), testing::HasSubstr(",N*"));
  state = State();
  state.quality = FixQuality::kEstimated;
  EXPECT_THAT(writer.Vtg(state), testing::HasSubstr(",E*"));
}

TEST(NmeaWriter, NothingIsRoundedBeyondItsRange) {
  NmeaState state = State();
  state.position = GeoPoint{Deg2Rad(89.0 + 59.9999999 / 60.0), Deg2Rad(180.0)};
  state.heading_rad = Deg2Rad(359.999);
  state.v_north_east_mps = {1.0, -1e-9};
  state.covariance_ned.setZero();
  const NmeaWriter writer("IN");
  EXPECT_THAT(writer.Gga(state), testing::HasSubstr(",9000.000000,N,18000.000000,E,1,12,0.1,"));
  EXPECT_THAT(writer.Hdt(state), testing::StartsWith("$INHDT,0.00,T*"));
  EXPECT_THAT(writer.Vtg(state), testing::StartsWith("$INVTG,0.00,T,"));
  state.covariance_ned(0, 0) = -1e-12;
  EXPECT_THAT(writer.Gst(state), testing::HasSubstr(",0.000,0.000,"));
}

// A sentence as our decoder splits it.
NmeaSentence Read(const std::string& line, Counters* counters) {
  const auto sentence =
      ParseNmea(std::string_view(line).substr(0, line.size() - 2), true, counters);
  EXPECT_TRUE(sentence && line.ends_with("\r\n") && line.size() <= 82) << line;
  return sentence.value_or(NmeaSentence{});
}

TEST(NmeaWriter, WhatItWritesIsReadAgain) {
  std::mt19937 random(1);
  const auto real = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 2000; ++i) {
    NmeaState state;
    const std::int64_t utime = static_cast<std::int64_t>(real(0.0, 4e15));
    state.time = FromUtime(utime);
    state.position = GeoPoint{real(-kPi / 2.0, kPi / 2.0), real(-kPi, kPi)};
    const Eigen::Matrix3d root = Eigen::Matrix3d::NullaryExpr([&] { return real(-20.0, 20.0); });
    state.covariance_ned = root * root.transpose();
    state.depth_m = real(-5.0, 11'000.0);
    state.altitude_m = real(0.0, 11'000.0);
    state.v_north_east_mps = {real(-20.0, 20.0), real(-20.0, 20.0)};
    state.heading_rad = real(-10.0, 10.0);
    const NmeaWriter writer("IN");
    Counters counters;
    const std::string gga_line = writer.Gga(state), zda_line = writer.Zda(state);
    const std::string vtg_line = writer.Vtg(state), hdt_line = writer.Hdt(state);
    const auto gga = DecodeGga(Read(gga_line, &counters));
    ASSERT_TRUE(gga && gga->position) << gga_line;
    EXPECT_NEAR(gga->position->latitude_rad, state.position->latitude_rad, 1.5e-10);
    EXPECT_NEAR(gga->position->longitude_rad, state.position->longitude_rad, 1.5e-10);
    const double sigma_m =
        std::sqrt(0.5 * (state.covariance_ned(0, 0) + state.covariance_ned(1, 1)));
    EXPECT_NEAR(NmeaWriter::kSigmaAtHdop1M * *gga->hdop, sigma_m, 0.301);
    EXPECT_EQ(ToUtime(*DecodeZda(Read(zda_line, &counters))), utime / 10'000 * 10'000);
    const std::string rmc_line = writer.Rmc(state);
    const auto rmc = DecodeRmc(Read(rmc_line, &counters));
    ASSERT_TRUE(rmc && rmc->position && rmc->midnight) << rmc_line;
    EXPECT_NEAR(rmc->position->latitude_rad, state.position->latitude_rad, 1.5e-10);
    EXPECT_NEAR(*rmc->speed_mps, state.v_north_east_mps.norm(), 3e-4);
    const auto vtg = DecodeVtg(Read(vtg_line, &counters));
    EXPECT_NEAR(*vtg->speed_mps, state.v_north_east_mps.norm(), 3e-4);
    const double heading = *DecodeHeading(Read(hdt_line, &counters));
    EXPECT_NEAR(std::remainder(heading - state.heading_rad, 2.0 * kPi), 0.0, Deg2Rad(0.0051));
    Read(writer.Gst(state), &counters);
    Read(writer.Dpt(state), &counters);
    EXPECT_TRUE(counters.empty());
  }
}

}  // namespace
}  // namespace seastitch
