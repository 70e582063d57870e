#include "codecs/makers/gsf_file.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "common/core/pose.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

const char* const kRealFile = "data/mbes/gsf_v3_08.gsf";
const char* const kGolden = "vectors/survey/gsf_v3_08_gsf.json";

MakeReader Reader() {
  return [] { return std::make_unique<GsfFileReader>(); };
}

void ExpectPing(const nlohmann::json& golden,
                const NavigationRecord& navigation,
                const PlacedPing& ping) {
  EXPECT_EQ(ToUtime(ping.time),
            golden["sec"].get<std::int64_t>() * 1'000'000 +
                (golden["ns"].get<std::int64_t>() + 500) / 1000);
  EXPECT_EQ(navigation.time, ping.time);
  EXPECT_NEAR(Rad2Deg(navigation.position->latitude_rad), golden["lat"].get<double>(), 1e-9);
  EXPECT_NEAR(Rad2Deg(navigation.position->longitude_rad), golden["lon"].get<double>(), 1e-9);
  const Eigen::Matrix3d expected = RotationFromRpy(Deg2Rad(golden["roll"].get<double>()),
                                                   Deg2Rad(golden["pitch"].get<double>()),
                                                   Deg2Rad(golden["heading"].get<double>()));
  EXPECT_LT((navigation.attitude->q_ned_imu.toRotationMatrix() - expected).norm(), 1e-12);
  EXPECT_NEAR(*navigation.heave_m, golden["heave"].get<double>(), 1e-12);
  EXPECT_FALSE(navigation.height_m);
  ASSERT_EQ(ping.soundings.size(), golden["n"]);
  for (const auto& [key, beam] : golden["beams"].items()) {
    const PlacedBeam& b = ping.soundings.at(std::stoul(key));
    EXPECT_NEAR(b.p_level_m.x(), beam["along"].get<double>(), 1e-4);
    EXPECT_NEAR(b.p_level_m.y(), beam["across"].get<double>(), 1e-3);
    EXPECT_NEAR(b.p_level_m.z(), beam["depth"].get<double>(), 1e-3);
    EXPECT_EQ((b.flags & kBeamValid) != 0, static_cast<int>(beam["bflags"].get<double>()) % 2 == 0);
  }
  EXPECT_EQ(std::count_if(ping.soundings.begin(),
                          ping.soundings.end(),
                          [](const PlacedBeam& b) { return (b.flags & kBeamValid) != 0; }),
            golden["usable_beams"]);
}

TEST(GsfFile, GoldenPingsOfARealFile) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = ReadJson(Shared(kGolden));
  const auto file = ReadSurvey<GsfFileReader>(BytesOf(Shared(kRealFile)));
  const auto pings = file.All<PlacedPing>();
  ASSERT_EQ(pings.size(), 8u);
  std::vector<NavigationRecord> of_pings, attitudes;
  for (const NavigationRecord& n : file.All<NavigationRecord>())
    (n.source == "gsf_ping" ? of_pings : attitudes).push_back(n);
  ASSERT_EQ(of_pings.size(), 8u);
  ExpectPing(golden["ping_first"], of_pings.front(), pings.front());
  // By scales that changed on the way.
  ExpectPing(golden["ping_last"], of_pings.back(), pings.back());
  EXPECT_EQ(file.counters,
            (Counters{{"gsf_ignored_6", 2}, {"gsf_ignored_7", 1}, {"gsf_ignored_9", 1}}));

  const auto& first = golden["attitude"]["first"];
  EXPECT_EQ(ToUtime(attitudes.front().time) / 1'000'000, first["sec"].get<std::int64_t>());
  const Eigen::Vector3d rpy =
      RpyFromRotation(attitudes.front().attitude->q_ned_imu.toRotationMatrix());
  EXPECT_NEAR(Rad2Deg(rpy.y()), first["first_raw"][1].get<int>() / 100.0, 1e-9);
  EXPECT_NEAR(Rad2Deg(rpy.x()), first["first_raw"][2].get<int>() / 100.0, 1e-9);
  EXPECT_NEAR(*attitudes.front().heave_m, first["first_raw"][3].get<int>() / 100.0, 1e-12);
  // 9900: no angle, no heave; the heading is good.
  EXPECT_FALSE(attitudes.back().attitude);
  EXPECT_FALSE(attitudes.back().heave_m);
  EXPECT_NEAR(*attitudes.back().heading_rad, Deg2Rad(52.4), 1e-12);

  const auto profile = file.All<SoundVelocityProfile>().at(0);
  EXPECT_EQ(profile.speed_mps.front(), golden["svp"]["first"][1]);
  EXPECT_EQ(profile.depth_m.back(), golden["svp"]["last"][0]);
  EXPECT_EQ(ToUtime(profile.time) / 1'000'000, golden["svp"]["observed"][0].get<std::int64_t>());
  EXPECT_EQ(file.All<SonarSettings>().at(0).values.at("TIDE_COMPENSATED"), "YES");
}

// --- made here --------------------------------------------------------------------------------

ByteVector Record(std::uint32_t type, const ByteWriter& data, bool checksum = false) {
  ByteWriter padded;
  padded.Append(data.bytes());
  padded.Zeros((4 - data.size() % 4) % 4);
  ByteWriter out;
  out.Be(static_cast<std::uint32_t>(padded.size()));
  out.Be(type | (checksum ? 1u << 31 : 0u));
  if (checksum)
    out.Be(std::accumulate(padded.bytes().begin(), padded.bytes().end(), std::uint32_t{0}));
  out.Append(padded.bytes());
  return out.Release();
}

ByteVector Header(const std::string& version) {
  ByteWriter data;
  for (const char c : version) data.Be(static_cast<std::uint8_t>(c));
  data.Zeros(12 - version.size());
  return Record(1, data);
}

struct PingParts {
  bool with_scales = true;
  std::uint8_t scale_id = 1;
  std::uint8_t compression = 0;
  std::uint32_t multiplier = 100;
  std::size_t depth_bytes = 2;
  std::uint16_t ping_flags = 0;
  bool checksum = false;
  bool of_version_2 = false;  // its head ends before height and separation
};

// Three beams, 51 m and 52 m deep, and one without a depth.
ByteVector Ping(const PingParts& parts = {}) {
  ByteWriter d;
  d.Be(std::uint32_t{1'700'000'000});
  d.Be(std::uint32_t{500'000'000});
  d.Be(std::int32_t{112'500'000});
  d.Be(std::int32_t{575'000'000});
  d.Be(std::uint16_t{3});
  d.Be(std::uint16_t{1});
  d.Be(parts.ping_flags);
  d.Zeros(8);
  d.Be(std::uint16_t{9000});
  d.Be(std::int16_t{-150});
  d.Be(std::int16_t{200});
  d.Be(std::int16_t{25});
  d.Zeros(parts.of_version_2 ? 4 : 18);
  const auto sub = [&d](std::uint8_t id, std::size_t size) {
    d.Be(std::uint32_t{id} << 24 | static_cast<std::uint32_t>(size));
  };
  if (parts.with_scales) {
    sub(100, 4 + 24);
    d.Be(std::uint32_t{2});
    d.Be(std::uint32_t{parts.scale_id} << 24 | std::uint32_t{parts.compression} << 16);
    d.Be(parts.multiplier);
    d.Be(std::int32_t{-50});
    d.Be(std::uint32_t{2} << 24);
    d.Be(std::uint32_t{10});
    d.Be(std::int32_t{0});
  }
  sub(1, 3 * parts.depth_bytes);
  for (const std::uint16_t raw : {std::uint16_t{100}, std::uint16_t{200}, std::uint16_t{0}}) {
    d.Zeros(parts.depth_bytes - 2);
    d.Be(raw);
  }
  sub(2, 6);
  for (const int raw : {-300, 10, 300}) d.Be(static_cast<std::int16_t>(raw));
  sub(16, 3);
  for (const std::uint8_t flag : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{4}}) d.Be(flag);
  sub(131, 5);  // of a sensor: stepped over
  d.Zeros(5);
  return Record(2, d, parts.checksum);
}

ByteVector Join(std::initializer_list<ByteVector> parts) {
  ByteVector all;
  for (const ByteVector& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(GsfFile, ScalesHoldForThePingsThatFollowAndFieldsMayBeOfFourBytes) {
  PingParts without;
  without.with_scales = false;
  without.depth_bytes = 4;
  const auto file = ReadSurvey<GsfFileReader>(Join({Header("GSF-v03.09"), Ping(), Ping(without)}));
  const auto pings = file.All<PlacedPing>();
  ASSERT_EQ(pings.size(), 2u);
  for (const PlacedPing& ping : pings) {
    ASSERT_EQ(ping.soundings.size(), 3u);
    EXPECT_EQ(ping.soundings[0].p_level_m, Eigen::Vector3f(0.0f, -30.0f, 51.0f));
    EXPECT_EQ(ping.soundings[0].flags, kBeamValid);
    EXPECT_EQ(ping.soundings[1].p_level_m, Eigen::Vector3f(0.0f, 1.0f, 52.0f));
    EXPECT_EQ(ping.soundings[1].flags, 0);
    EXPECT_EQ(*ping.origin_depth_m, 0.0);
  }
  EXPECT_EQ(pings[1].ping_number, 1u);
  EXPECT_TRUE(file.counters.empty());
}

TEST(GsfFile, APingThatIsToBeIgnoredHasNoValidBeam) {
  PingParts parts;
  parts.ping_flags = 1;
  const auto file = ReadSurvey<GsfFileReader>(Join({Header("GSF-v03.09"), Ping(parts)}));
  const auto pings = file.All<PlacedPing>();
  for (const PlacedBeam& beam : pings.at(0).soundings) EXPECT_EQ(beam.flags, 0);
}

TEST(GsfFile, WhatCannotBeIsRefusedAndCounted) {
  const auto counters = [](const PingParts& parts) {
    const auto file = ReadSurvey<GsfFileReader>(Join({Header("GSF-v03.09"), Ping(parts)}));
    EXPECT_TRUE(file.All<PlacedPing>().empty());
    return file.counters;
  };
  const Counters malformed{{"gsf_malformed", 1}};
  PingParts parts;
  for (const std::uint8_t id : {std::uint8_t{0}, std::uint8_t{32}, std::uint8_t{255}}) {
    parts.scale_id = id;
    EXPECT_EQ(counters(parts), malformed);
  }
  parts = {};
  parts.multiplier = 0;
  EXPECT_EQ(counters(parts), malformed);
  parts = {};
  parts.with_scales = false;  // and none before
  EXPECT_EQ(counters(parts), malformed);
  parts = {};
  parts.depth_bytes = 3;
  EXPECT_EQ(counters(parts), malformed);
  parts = {};
  parts.compression = 1;
  EXPECT_EQ(counters(parts), (Counters{{"gsf_compressed", 1}, {"gsf_malformed", 1}}));
}

TEST(GsfFile, UpToVersion2AHeadOfAPingIsShorter) {
  PingParts parts;
  parts.of_version_2 = true;
  const auto old = ReadSurvey<GsfFileReader>(Join({Header("GSF-v02.09"), Ping(parts)}));
  const auto present = ReadSurvey<GsfFileReader>(Join({Header("GSF-v03.09"), Ping()}));
  EXPECT_TRUE(old.counters.empty());
  const auto pings = old.All<PlacedPing>();
  ASSERT_EQ(pings.size(), 1u);
  const PlacedPing expected = present.All<PlacedPing>().at(0);
  EXPECT_EQ(pings[0].time, expected.time);
  ASSERT_EQ(pings[0].soundings.size(), expected.soundings.size());
  for (std::size_t i = 0; i < expected.soundings.size(); ++i) {
    EXPECT_EQ(pings[0].soundings[i].p_level_m, expected.soundings[i].p_level_m);
    EXPECT_EQ(pings[0].soundings[i].flags, expected.soundings[i].flags);
  }
}

TEST(GsfFile, PositionsOfPingsWithoutDepthsAreRead) {
  const std::filesystem::path real = Shared("cases/gsf_version/v2.gsf");
  SKIP_WITHOUT(real);
  const auto file = ReadSurvey<GsfFileReader>(BytesOf(real));
  const auto navigation = file.All<NavigationRecord>();
  ASSERT_EQ(navigation.size(), 3u);
  EXPECT_NEAR(Rad2Deg(navigation[0].position->latitude_rad), 38.0030681, 1e-7);
  EXPECT_NEAR(Rad2Deg(navigation[0].position->longitude_rad), -76.3502001, 1e-7);
  EXPECT_EQ(file.counters.at("gsf_ping_without_depths"), 3);
}

TEST(GsfFile, AnotherVersionIsNotReadByTheRulesOfThisOne) {
  const auto file = ReadSurvey<GsfFileReader>(Join({Header("GSF-v04.00"), Ping()}));
  EXPECT_TRUE(file.records.empty());
  EXPECT_EQ(file.counters, (Counters{{"gsf_version_unknown", 1}}));
}

TEST(GsfFile, AChecksumIsHeld) {
  PingParts parts;
  parts.checksum = true;
  ByteVector bytes = Join({Header("GSF-v03.09"), Ping(parts)});
  EXPECT_EQ(ReadSurvey<GsfFileReader>(bytes).All<PlacedPing>().size(), 1u);
  bytes.back() ^= 1;
  const auto file = ReadSurvey<GsfFileReader>(bytes);
  EXPECT_TRUE(file.records.empty());
  EXPECT_EQ(file.counters, (Counters{{"gsf_malformed", 1}}));
}

TEST(GsfFile, AnyPiecesAndAnyDamage) {
  PingParts summed;
  summed.checksum = true;
  ExpectRobust(Join({Header("GSF-v03.09"), Ping(), Ping(), Ping(summed), Ping()}), Reader());
  SKIP_WITHOUT(Shared("vectors/survey/gsf"));
  ByteVector real;
  for (const char* number : {"01", "09", "06", "04", "03", "02", "12", "07"}) {
    const ByteVector one =
        BytesOf(Shared(std::string("vectors/survey/gsf/record_") + number + ".bin"));
    real.insert(real.end(), one.begin(), one.end());
  }
  ExpectRobust(real, Reader());
}

}  // namespace
}  // namespace seastitch
