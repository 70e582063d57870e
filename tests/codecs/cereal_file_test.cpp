#include "codecs/makers/cereal_file.hpp"

#include <gtest/gtest.h>

#include "common/core/pose.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

const char* const kGolden = "vectors/survey/cereal/mbes_pings.cereal";

MakeReader Reader() {
  return [] { return std::make_unique<CerealFileReader>(); };
}

// Where a point of a ping lies in the grid, by its pose and the ping.
Eigen::Vector3d EastNorthUp(const NavigationRecord& pose, const PlacedBeam& beam, double depth_m) {
  const double heading_rad = RpyFromRotation(pose.attitude->q_ned_imu.toRotationMatrix()).z();
  const Eigen::Vector3d ned =
      RotationFromRpy(0.0, 0.0, heading_rad) * beam.p_level_m.cast<double>();
  return {pose.grid_north_east_m->y() + ned.y(),
          pose.grid_north_east_m->x() + ned.x(),
          -depth_m - ned.z()};
}

TEST(CerealFile, GoldenPingsAreWhereAuvlibPutsThem) {
  SKIP_WITHOUT(Shared(kGolden));
  const auto golden = ReadJson(Shared("vectors/survey/cereal/mbes_pings.json"))["pings"];
  const auto file = ReadSurvey<CerealFileReader>(BytesOf(Shared(kGolden)));
  EXPECT_TRUE(file.counters.empty());
  const auto poses = file.All<NavigationRecord>();
  const auto pings = file.All<PlacedPing>();
  ASSERT_EQ(poses.size(), golden.size());
  ASSERT_EQ(pings.size(), golden.size());
  for (std::size_t i = 0; i < golden.size(); ++i) {
    EXPECT_EQ(ToUtime(pings[i].time), golden[i]["time_stamp_"].get<std::int64_t>() * 1000);
    EXPECT_EQ(pings[i].ping_number, golden[i]["id_"]);
    const Eigen::Vector3d rpy = RpyFromRotation(poses[i].attitude->q_ned_imu.toRotationMatrix());
    EXPECT_NEAR(rpy.x(), golden[i]["roll_"].get<double>(), 1e-12);
    EXPECT_NEAR(rpy.y(), golden[i]["pitch_"].get<double>(), 1e-12);
    EXPECT_NEAR(rpy.z(), kPi / 2.0 - golden[i]["heading_"].get<double>(), 1e-12);
    EXPECT_EQ(*poses[i].depth_m, -golden[i]["pos_"][2].get<double>());
    ASSERT_EQ(pings[i].soundings.size(), golden[i]["beams"].size());
    for (std::size_t k = 0; k < pings[i].soundings.size(); ++k) {
      const auto p = golden[i]["beams"][k].get<std::vector<double>>();
      EXPECT_TRUE(EastNorthUp(poses[i], pings[i].soundings[k], *pings[i].origin_depth_m)
                      .isApprox(Eigen::Vector3d(p[0], p[1], p[2]), 1e-12));
    }
  }
}

TEST(CerealFile, ThePortableArchiveIsTheSameBehindOneByte) {
  SKIP_WITHOUT(Shared(kGolden));
  ByteVector bytes = BytesOf(Shared(kGolden));
  const auto binary = ReadSurvey<CerealFileReader>(bytes);
  bytes.insert(bytes.begin(), 1);
  EXPECT_EQ(TextOf(ReadSurvey<CerealFileReader>(bytes)), TextOf(binary));
}

struct PingParts {
  std::uint64_t num_beams = 2;
  std::uint64_t num_strengths = 0;
  std::int64_t stamp = 1'714'645'230;
  std::string time = "2024-May-02";
};

ByteVector File(const PingParts& parts = {}, std::uint64_t count = 257) {
  const auto point = [](ByteWriter* out, double x, double y, double z) {
    out->Le(std::int32_t{3});
    out->Le(std::int32_t{1});
    for (const double v : {x, y, z}) out->Le(v);
  };
  ByteWriter out;
  out.Le(count);
  out.Le(std::uint32_t{7});
  out.Le(static_cast<std::uint64_t>(parts.time.size()));
  for (const char c : parts.time) out.Le(static_cast<std::uint8_t>(c));
  out.Le(parts.stamp);
  for (int i = 0; i < 4; ++i) out.Le(0.0);
  out.Le(std::uint8_t{1});
  point(&out, 1000.0, 2000.0, -20.0);
  out.Le(parts.num_beams);
  point(&out, 1010.0, 2000.0, -50.0);  // heading east: ahead
  point(&out, 1000.0, 1990.0, -51.0);  // to starboard
  out.Le(parts.num_strengths);
  return out.Release();
}

TEST(CerealFile, EastIsAheadOfAVehicleThatHeadsEast) {
  const auto file = ReadSurvey<CerealFileReader>(File());
  const PlacedPing ping = file.All<PlacedPing>().at(0);
  EXPECT_EQ(ping.soundings.at(0).p_level_m, Eigen::Vector3f(10.0f, 0.0f, 30.0f));
  EXPECT_EQ(ping.soundings.at(1).p_level_m, Eigen::Vector3f(0.0f, 10.0f, 31.0f));
  EXPECT_EQ(*ping.origin_depth_m, 20.0);
  EXPECT_EQ(ToUtime(ping.time), 1'714'645'230'000'000);  // seconds, as its script has them
}

// Pings with these stamps, in one file.
ByteVector FileOf(const std::vector<std::int64_t>& stamps) {
  ByteVector file;
  for (const std::int64_t stamp : stamps) {
    PingParts parts;
    parts.stamp = stamp;
    ByteVector one = File(parts);
    if (!file.empty()) one.erase(one.begin(), one.begin() + 8);
    file.insert(file.end(), one.begin(), one.end());
  }
  return file;
}

std::vector<std::int64_t> TimesMs(const SurveyContents& file) {
  std::vector<std::int64_t> times;
  for (const PlacedPing& ping : file.All<PlacedPing>()) times.push_back(ToUtime(ping.time) / 1000);
  return times;
}

TEST(CerealFile, PingsOfOneSecondAreSpreadOverIt) {
  const auto file = ReadSurvey<CerealFileReader>(FileOf({100, 100, 100, 100, 101, 103, 103}));
  EXPECT_EQ(
      TimesMs(file),
      (std::vector<std::int64_t>{100'000, 100'250, 100'500, 100'750, 101'000, 103'000, 103'500}));
  const auto poses = file.All<NavigationRecord>();
  ASSERT_EQ(poses.size(), 7u);
  EXPECT_EQ(ToUtime(poses[3].time), 100'750'000);
  const std::int64_t ms = 1'714'645'230'001;
  EXPECT_EQ(TimesMs(ReadSurvey<CerealFileReader>(FileOf({ms, ms, ms + 5}))),
            (std::vector<std::int64_t>{ms, ms, ms + 5}));
  EXPECT_EQ(TimesMs(ReadSurvey<CerealFileReader>(FileOf({ms - 1, ms - 1, ms + 999}))),
            (std::vector<std::int64_t>{ms - 1, ms + 499, ms + 999}));
}

TEST(CerealFile, PingsWithoutATimeAreRefusedAndCounted) {
  const auto none = ReadSurvey<CerealFileReader>(FileOf({0, 0, 0}));
  EXPECT_TRUE(none.records.empty());
  EXPECT_EQ(none.counters, (Counters{{"cereal_malformed", 3}}));
  const auto still =
      ReadSurvey<CerealFileReader>(FileOf(std::vector<std::int64_t>(1005, 1'714'645'230)));
  EXPECT_EQ(still.All<PlacedPing>().size(), 1000u);
  EXPECT_EQ(still.counters, (Counters{{"cereal_stamp_stands_still", 5}}));
}

TEST(CerealFile, CountsThatCannotBeAllocateNothing) {
  for (const std::uint64_t count : {std::uint64_t{3}, ~std::uint64_t{0}, std::uint64_t{1} << 61}) {
    PingParts beams;
    beams.num_beams = count;
    PingParts strengths;
    strengths.num_strengths = count;
    for (const PingParts& parts : {beams, strengths}) {
      const auto file = ReadSurvey<CerealFileReader>(File(parts));
      EXPECT_TRUE(file.records.empty());
      EXPECT_GT(file.counters.at("damaged_bytes"), 0);
    }
  }
}

TEST(CerealFile, AnyPiecesAndAnyDamage) {
  SKIP_WITHOUT(Shared(kGolden));
  ExpectRobust(BytesOf(Shared(kGolden)), Reader());
}

}  // namespace
}  // namespace seastitch
