#include "codecs/navigation/nmea0183.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codecs/lines/line_stream.hpp"
#include "codecs/navigation/depth_text.hpp"
#include "codecs/navigation/nmea0183_writer.hpp"
#include "common/core/pose.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

using testing::ElementsAre;

// --- lines ---------------------------------------------------------------------------------------

std::vector<std::string> LinesOf(const std::vector<std::string>& pieces) {
  LineStream stream;
  std::vector<std::string> lines;
  for (const std::string& piece : pieces)
    for (const auto& line :
         stream.Add(Bytes(std::vector<std::uint8_t>(piece.begin(), piece.end())), Time()))
      lines.push_back(line.text);
  return lines;
}

TEST(LineStream, PiecesOfAnySizeGiveTheSameLines) {
  const std::string text = "$GPHDT,1.0,T*00\r\n0009.996,M\r\n*00010015.3200\r\n$X";
  for (std::size_t size = 1; size <= text.size(); ++size) {
    std::vector<std::string> pieces;
    for (std::size_t i = 0; i < text.size(); i += size) pieces.push_back(text.substr(i, size));
    EXPECT_THAT(LinesOf(pieces), ElementsAre("$GPHDT,1.0,T*00", "0009.996,M", "*00010015.3200"));
  }
}

TEST(LineStream, ASentenceWithoutLineEndIsGivenAtItsChecksum) {
  EXPECT_THAT(LinesOf({"$GPHDT,1.0,T*00"}), ElementsAre("$GPHDT,1.0,T*00"));
}

TEST(LineStream, ASentenceThatIsCutEndsWhereTheNextBegins) {
  EXPECT_THAT(LinesOf({"$GPHDT,1.0$GPHDT,2.0,T*00\n"}),
              ElementsAre("$GPHDT,1.0", "$GPHDT,2.0,T*00"));
}

TEST(LineStream, WhatHasNoEndIsBoundedAndCounted) {
  LineStream stream;
  const std::vector<std::uint8_t> noise(5000, 'x');
  EXPECT_TRUE(stream.Add(noise, Time()).empty());
  EXPECT_GE(stream.too_long_bytes(), 4000);
}

TEST(LineStream, ALineHasTheStampOfThePieceInWhichItBegan) {
  LineStream stream;
  const std::vector<std::uint8_t> first{'a', '\n', 'b'}, second{'c', '\n'};
  EXPECT_EQ(stream.Add(first, FromUtime(10)).at(0).recv, FromUtime(10));
  const auto lines = stream.Add(second, FromUtime(20));
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].text, "bc");
  EXPECT_EQ(lines[0].recv, FromUtime(10));
}

// --- sentences -----------------------------------------------------------------------------------

std::string WithSum(const std::string& body) {
  int sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  char text[8];
  std::snprintf(text, sizeof text, "*%02X", sum);
  return "$" + body + text;
}

NmeaSentence Sentence(const std::string& line) {
  static std::string kept;
  kept = line;
  Counters counters;
  const auto sentence = ParseNmea(kept, true, &counters);
  EXPECT_TRUE(sentence) << line;
  return sentence.value_or(NmeaSentence{});
}

TEST(Nmea, AWrongOrMissingChecksumIsRefusedByItsName) {
  Counters counters;
  EXPECT_FALSE(ParseNmea("$HEHDT,275.25,T*00", true, &counters));
  EXPECT_FALSE(ParseNmea("$HEHDT,275.25,T", true, &counters));
  EXPECT_TRUE(ParseNmea("$HEHDT,275.25,T", false, &counters));
  EXPECT_FALSE(ParseNmea("$HEHDT,275.25,T*00", false, &counters)) << "there, and wrong";
  EXPECT_FALSE(ParseNmea("$HEHDT,275.25,T*1", true, &counters));
  EXPECT_FALSE(ParseNmea("HEHDT,275.25,T*18", true, &counters));
  EXPECT_FALSE(ParseNmea("$*00", true, &counters));
  EXPECT_THAT(counters,
              ElementsAre(testing::Pair("nmea_checksum_missing", 1),
                          testing::Pair("nmea_checksum_wrong", 2),
                          testing::Pair("nmea_malformed", 3)));
}

TEST(Nmea, AnEmptyFieldIsNotZero) {
  EXPECT_FALSE(DecodeHeading(Sentence(WithSum("HEHDT,,T"))));
  EXPECT_FALSE(DecodePrdid(Sentence(WithSum("PRDID,,2.0,275.25"))));
  EXPECT_FALSE(DecodeGga(Sentence(WithSum("GPGGA,102031.00,,,,,1,09,0.9,,M,,M,,"))));
  const auto vtg = DecodeVtg(Sentence(WithSum("GPVTG,,T,,M,0.00,N,0.00,K,A")));
  ASSERT_TRUE(vtg);
  EXPECT_FALSE(vtg->course_rad) << "one that stands has no course";
  EXPECT_EQ(vtg->speed_mps, 0.0);
}

TEST(Nmea, ImpossibleValuesAreNotGiven) {
  for (const char* body : {"GPGGA,102030.00,9130.00,N,01115.00,E,1,09,0.9,3.0,M,40.0,M,,",
                           "GPGGA,102030.00,5760.00,N,01115.00,E,1,09,0.9,3.0,M,40.0,M,,",
                           "GPGGA,102030.00,5730.00,N,18115.00,E,1,09,0.9,3.0,M,40.0,M,,",
                           "GPGGA,102030.00,5730.00,E,01115.00,N,1,09,0.9,3.0,M,40.0,M,,",
                           "GPGGA,102030.00,-5730.00,N,01115.00,E,1,09,0.9,3.0,M,40.0,M,,",
                           "GPGGA,102030.00,5730.00,N,01115.00,E,x,09,0.9,3.0,M,40.0,M,,"})
    EXPECT_FALSE(DecodeGga(Sentence(WithSum(body)))) << body;
  EXPECT_FALSE(DecodeHeading(Sentence(WithSum("HEHDT,361.0,T"))));
  EXPECT_FALSE(DecodeHeading(Sentence(WithSum("HETHS,10.0,V")))) << "called void";
  EXPECT_FALSE(DecodePsxn23(Sentence(WithSum("PSXN,23,95.0,0.0,10.0,0.0"))));
  EXPECT_FALSE(DecodeVtg(Sentence(WithSum("GPVTG,274.0,T,,M,4.86,N,9.00,K,N")))) << "not valid";
  EXPECT_FALSE(DecodeZda(Sentence(WithSum("GPZDA,102030.50,31,02,2024,00,00"))));
  for (const char* text : {"246060", "24", "2a3030", "-13030", "236060", ""})
    EXPECT_FALSE(TimeOfDayFromNmea(text)) << text;
}

TEST(Nmea, CutAtEveryLengthNothingIsReadAndNothingBreaks) {
  for (const std::string line :
       {"$GPGGA,102030.50,5730.123456,N,01115.654321,E,4,14,0.8,3.25,M,40.50,M,1.2,0123*4C",
        "$PASHR,102030.500,275.25,T,+2.00,-1.50,+0.25,0.020,0.021,0.050,2,1*39"})
    for (std::size_t n = 0; n < line.size(); ++n) {
      Counters counters;
      EXPECT_FALSE(ParseNmea(line.substr(0, n), true, &counters)) << n;
    }
}

TEST(Nmea, OneFlippedBitIsNeverRead) {
  const std::string line = "$PSXN,23,2.00,-1.50,275.25,0.25*13";
  for (std::size_t i = 1; i < line.size(); ++i)
    for (int bit = 0; bit < 7; ++bit) {
      std::string flipped = line;
      flipped[i] = static_cast<char>(flipped[i] ^ (1 << bit));
      Counters counters;
      const auto sentence = ParseNmea(flipped, true, &counters);
      if (!sentence) continue;  // hex digits of either case are the same number
      EXPECT_EQ(std::tolower(flipped[i]), std::tolower(line[i])) << flipped;
    }
}

// --- golden --------------------------------------------------------------------------------------

std::filesystem::path Golden(const std::string& name) {
  return Shared("vectors/survey/nav/" + name);
}

double Deg(const std::optional<double>& rad) { return Rad2Deg(rad.value_or(std::nan(""))); }

class GoldenSentences : public testing::Test {
 protected:
  // The sentence that begins so, as the golden file has it.
  nlohmann::json Values(const std::string& begin) {
    for (const auto& line : golden_["lines"]) {
      line_ = line["sentence"].get<std::string>();
      if (line_.starts_with(begin)) return line["values"];
    }
    ADD_FAILURE() << begin;
    return {};
  }
  NmeaSentence Parsed() const { return Sentence(line_); }
  void SetUp() override {
    SKIP_WITHOUT(Golden("nmea.json"));
    golden_ = ReadJson(Golden("nmea.json"));
  }

  nlohmann::json golden_;
  std::string line_;
};

TEST_F(GoldenSentences, Positions) {
  auto values = Values("$GPGGA,102030");
  const auto gga = DecodeGga(Parsed());
  ASSERT_TRUE(gga && gga->position);
  EXPECT_EQ(ToSeconds(*gga->time_of_day), values["utc"]);
  EXPECT_NEAR(Deg(gga->position->latitude_rad), values["lat"], 1e-8);
  EXPECT_NEAR(Deg(gga->position->longitude_rad), values["lon"], 1e-8);
  EXPECT_EQ(static_cast<int>(gga->quality), values["quality"]);
  EXPECT_EQ(gga->hdop, values["hdop"].get<double>());
  EXPECT_EQ(gga->height_m, values["ellipsoid_height"].get<double>());

  Values("$GPGGA,102031");
  const auto no_fix = DecodeGga(Parsed());
  ASSERT_TRUE(no_fix);
  EXPECT_FALSE(no_fix->position);

  values = Values("$GNRMC");
  const auto rmc = DecodeRmc(Parsed());
  ASSERT_TRUE(rmc && rmc->position && rmc->midnight);
  EXPECT_EQ(ToUtime(*rmc->midnight + *rmc->time_of_day), 1'714'645'230'500'000);
  EXPECT_NEAR(*rmc->speed_mps, values["sog_mps"], 5e-5);
  EXPECT_NEAR(Deg(rmc->course_rad), values["cog"], 1e-9);

  values = Values("$GPVTG");
  EXPECT_NEAR(*DecodeVtg(Parsed())->speed_mps, values["sog_mps"], 5e-4);
  values = Values("$GPZDA");
  EXPECT_EQ(ToUtime(*DecodeZda(Parsed())),
            static_cast<std::int64_t>(values["unix"].get<double>() * 1e6));
}

TEST_F(GoldenSentences, Attitudes) {
  auto values = Values("$HEHDT,275.25,T*18");
  EXPECT_NEAR(Deg(DecodeHeading(Parsed())), values["heading"], 1e-9);
  values = Values("$PASHR");
  const auto pashr = DecodePashr(Parsed());
  ASSERT_TRUE(pashr);
  const Eigen::Vector3d sigma_deg = pashr->sigma_rpy_rad * Rad2Deg(1.0);
  EXPECT_NEAR(sigma_deg.x(), values["roll_sd"], 1e-9);
  EXPECT_NEAR(sigma_deg.y(), values["pitch_sd"], 1e-9);
  EXPECT_NEAR(sigma_deg.z(), values["heading_sd"], 1e-9);
  const auto expect = [&](const std::optional<NmeaAttitude>& attitude) {
    ASSERT_TRUE(attitude);
    EXPECT_NEAR(Rad2Deg(attitude->roll_rad), values["roll"], 1e-9);
    EXPECT_NEAR(Rad2Deg(attitude->pitch_rad), values["pitch"], 1e-9);
    EXPECT_NEAR(Deg(attitude->heading_rad), values["heading"], 1e-9);
  };
  expect(pashr);
  values = Values("$PRDID");
  expect(DecodePrdid(Parsed()));
  values = Values("$PSXN,23");
  expect(DecodePsxn23(Parsed()));
  Values("$PSXN,20");
  const auto quality = DecodePsxn20(Parsed());
  ASSERT_TRUE(quality);
  EXPECT_EQ(quality->horizontal + quality->height + quality->heading + quality->roll_pitch, 0);
}

TEST_F(GoldenSentences, AcousticPositions) {
  auto values = Values("$PSIMSSB,102031");
  const auto radians = DecodePsimssb(Parsed());
  ASSERT_TRUE(radians && radians->position);
  EXPECT_NEAR(Deg(radians->position->latitude_rad), values["lat_deg"], 1e-9);
  EXPECT_NEAR(Deg(radians->position->longitude_rad), values["lon_deg"], 1e-9);
  EXPECT_EQ(radians->accuracy_m, values["accuracy"].get<double>());
  values = Values("$PSIMSSB,102030");
  const auto from_ship = DecodePsimssb(Parsed());
  ASSERT_TRUE(from_ship);
  EXPECT_TRUE(from_ship->valid);
  EXPECT_EQ(from_ship->transponder, values["transponder"]);
  EXPECT_FALSE(from_ship->is_absolute);
  values = Values("$PSIMSSB,102032");
  const auto invalid = DecodePsimssb(Parsed());
  ASSERT_TRUE(invalid);
  EXPECT_FALSE(invalid->valid);
  EXPECT_EQ(invalid->error, values["error"]);
  // Degrees, as seen in the field: a letter behind each, and what follows one field later each.
  const auto degrees = DecodePsimssb(
      Sentence("$PSIMSSB,102031.50,B01,A,,D,N,F,5730.0000,N,01115.0000,W,134.10,0.5,N,,*"));
  ASSERT_TRUE(degrees && degrees->position);
  EXPECT_NEAR(Deg(degrees->position->latitude_rad), 57.5, 1e-9);
  EXPECT_NEAR(Deg(degrees->position->longitude_rad), -11.25, 1e-9);
  EXPECT_EQ(degrees->accuracy_m, 0.5);
}

TEST_F(GoldenSentences, Depths) {
  using Kind = DepthReading::Kind;
  const auto expect = [](const std::optional<DepthReading>& reading, Kind kind, double value) {
    ASSERT_TRUE(reading);
    EXPECT_EQ(reading->kind, kind);
    EXPECT_DOUBLE_EQ(reading->value, value);
  };
  auto values = Values("$SDDBS");
  expect(DecodeDepthSentence(Parsed()), Kind::kDepthM, values["depth_below_surface"]);
  values = Values("$PRVAT");
  expect(DecodeDepthSentence(Parsed()), Kind::kPressureDbar, values["pressure_dbar"]);
  values = Values("$PIPS");
  expect(DecodeDepthSentence(Parsed()), Kind::kDepthM, values["depth"]);
  values = Values("$PVIPS2");
  expect(DecodeDepthSentence(Parsed()), Kind::kDepthM, values["depth"]);
  values = Values("*0001");
  expect(DecodeDepthLine(line_), Kind::kPressure, values["value"]);
  values = Values("0009.996,M,");
  expect(DecodeDepthLine(line_), Kind::kDepthM, values["depth"]);
  expect(DecodeDepthLine("0010.051,dBar"), Kind::kPressureDbar, 10.051);
  for (const char* bad : {"",
                          "*",
                          "*0001",
                          "*00a10015.32",
                          "0009.996",
                          "0009.996,F",
                          "x,M",
                          "1,M,x",
                          "1,M,2,3",
                          "$PIPS,0001.00,M*78"})
    EXPECT_FALSE(DecodeDepthLine(bad)) << bad;
}

// Whatever comes, nothing breaks, and every line has one fate.
TEST(Nmea, RandomLinesNeverBreakADecoder) {
  std::mt19937 random(7);
  const std::string letters = "$*,.0123456789ABDEGHIMNPRSTVXZ-+ \r";
  for (int i = 0; i < 20'000; ++i) {
    std::string body;
    for (const char* type : {"GPGGA", "GNRMC", "PASHR", "PSIMSSB", "PSXN"})
      if (random() % 5 == 0) body = type;
    for (std::size_t n = random() % 60; n > 0; --n) body += letters[random() % letters.size()];
    Counters counters;
    const std::string line = WithSum(body);
    const auto s = ParseNmea(line, true, &counters);
    DecodeDepthLine(body);
    if (!s) {
      EXPECT_EQ(counters.size(), 1u);
      continue;
    }
    if (const auto gga = DecodeGga(*s); gga && gga->position) {
      EXPECT_LE(std::abs(gga->position->latitude_rad), Deg2Rad(90.0));
    }
    DecodeRmc(*s);
    DecodeVtg(*s);
    DecodeZda(*s);
    DecodeHeading(*s);
    DecodePashr(*s);
    DecodePrdid(*s);
    DecodePsxn23(*s);
    DecodePsxn20(*s);
    DecodePsimssb(*s);
    DecodeDepthSentence(*s);
  }
}

// --- what we send: the form by hand, the values back through the decoder -------------------------

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
  EXPECT_EQ(writer.Gst(State()), "$INGST,123456.78,,4.000,3.000,90.00,3.000,4.000,0.100*69\r\n");
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
  EXPECT_THAT(writer.Rmc(state),
              testing::StartsWith("$INRMC,123456.78,V,,,,,1.944,270.00,010326,,,N*"));
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
    EXPECT_NEAR(kGpsSigmaAtHdop1M * *gga->hdop, sigma_m, 0.301);
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
