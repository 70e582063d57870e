// Soundings by line: LAS as a script writes it from the format's description, and text.

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "codecs/lines/las_file.hpp"
#include "codecs/lines/xyz_file.hpp"
#include "tests/codecs/one_each.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;

ByteVector Las(const json& spec) {
  TemporaryDir dir;
  const std::string input = dir.Write("in.json", spec.dump());
  const std::string file = (dir.path() / "a.las").string();
  const auto written =
      RunCommand("python3 " + (SourceDir() / "tests/codecs/write_las.py").string() + " " + file +
                 " < " + input);
  EXPECT_EQ(written.exit_code, 0) << written.output;
  return BytesOf(file);
}

// x, y, z, time, class, source, withheld, overlap
json Points() {
  return {{500'000.125, 6'400'000.5, -30.25, 1000.5, 2, 7, 0, 0},
          {500'001.0, 6'400'001.0, -31.0, 1000.6, 7, 7, 0, 0},
          {500'002.0, 6'400'002.0, -32.0, 1000.7, 2, 8, 1, 0},
          {500'003.0, 6'400'003.0, -33.0, 1000.8, 9, 8, 0, 1}};
}

SurveyContents ReadLas(const ByteVector& bytes) {
  LasFileReader reader(std::make_unique<OneEach>());
  return ReadSurvey(bytes, &reader);
}

TEST(LasFile, EveryVersionAndPointFormatGivesItsPoints) {
  for (int format = 0; format <= 10; ++format) {
    for (int version = format < 6 ? 0 : 4; version <= 4; ++version) {
      const auto bytes = Las({{"version", version},
                              {"format", format},
                              {"offset", {500'000.0, 6'400'000.0, 0.0}},
                              {"epsg", 32632},
                              {"tail", 99},
                              {"points", Points()}});
      const auto file = ReadLas(bytes);
      const auto points = file.All<PlacedPing>();
      ASSERT_EQ(points.size(), 2u) << version << ' ' << format;
      EXPECT_NEAR(
          (points[0].p_vehicle_origin_m - Eigen::Vector3d(500'000.125, 6'400'000.5, -30.25)).norm(),
          0.0,
          1e-6);
      EXPECT_NEAR(
          (points[1].p_vehicle_origin_m - Eigen::Vector3d(500'003.0, 6'400'003.0, -33.0)).norm(),
          0.0,
          1e-6);
      const bool timed = format != 0 && format != 2;
      EXPECT_EQ(ToUtime(points[1].time), timed ? 1'000'800'000 : -1'000'000) << format;
      EXPECT_EQ(points[0].ping_number, 7u);
      EXPECT_EQ(points[1].ping_number, 8u);
      EXPECT_EQ(file.counters, (Counters{{"las_points_noise", 1}, {"las_points_withheld", 1}}));
      EXPECT_EQ(ReadLasHead(bytes)->crs, "EPSG:32632");
    }
  }
}

TEST(LasFile, TheHeadHasTheReferenceSystem) {
  const auto wkt =
      Las({{"version", 4}, {"format", 6}, {"wkt", "PROJCS[\"x\"]"}, {"points", Points()}});
  EXPECT_EQ(ReadLasHead(wkt)->crs, "PROJCS[\"x\"]");
  const auto feet =
      Las({{"epsg", 4326}, {"key", 2048}, {"vertical_unit", 9002}, {"points", Points()}});
  EXPECT_EQ(ReadLasHead(feet)->crs, "EPSG:4326");
  EXPECT_EQ(ReadLasHead(feet)->z_unit_m, 0.3048);
  const auto own = Las({{"epsg", 32767}, {"points", Points()}});
  EXPECT_EQ(ReadLasHead(own)->crs, "");
  EXPECT_FALSE(ReadLasHead(own)->compressed);
  EXPECT_TRUE(ReadLasHead(Las({{"compression", 128}, {"points", Points()}}))->compressed);
}

// Seconds of the GPS week go on past its end, whatever the order; longer times stay as they are.
TEST(LasFile, AWeekThatEndsGoesOn) {
  const auto times_of = [](const std::vector<double>& times_s, bool adjusted) {
    json points = json::array();
    for (const double time_s : times_s)
      points.push_back({500'000.0, 6'400'000.0, -30.0, time_s, 2, 7, 0, 0});
    std::vector<double> read_s;
    for (const PlacedPing& point :
         ReadLas(Las({{"adjusted", adjusted}, {"points", points}})).All<PlacedPing>())
      read_s.push_back(1e-6 * static_cast<double>(ToUtime(point.time)));
    return read_s;
  };
  EXPECT_THAT(times_of({604'799.0, 1.0, 604'798.0, 2.0}, false),
              ElementsAre(604'799.0, 604'801.0, 604'798.0, 604'802.0));
  EXPECT_THAT(times_of({1.0, 604'799.0}, false), ElementsAre(1.0, -1.0));
  EXPECT_THAT(times_of({1'000.0, 500'000.0}, true), ElementsAre(1'000.0, 500'000.0));
  EXPECT_THAT(times_of({3.0e8, 3.0e8 + 500'000.0}, false), ElementsAre(3.0e8, 3.0e8 + 500'000.0));
}

TEST(LasFile, ACutFileIsCounted) {
  ByteVector bytes = Las({{"points", Points()}});
  bytes.resize(bytes.size() - 28 - 5);
  LasFileReader reader(std::make_unique<OneEach>());
  const auto file = ReadSurvey(bytes, &reader);
  EXPECT_EQ(reader.missing(), 2u);
  EXPECT_EQ(file.All<PlacedPing>().size(), 1u);
  EXPECT_EQ(file.counters, (Counters{{"damaged_bytes", 23}, {"las_points_noise", 1}}));
}

TEST(LasFile, AHeadThatContradictsItselfGivesNothing) {
  const ByteVector good = Las({{"points", Points()}});
  const auto with = [&good](std::size_t at, std::uint8_t value) {
    ByteVector bytes = good;
    bytes[at] = value;
    return ReadLas(bytes);
  };
  EXPECT_EQ(with(25, 9).counters, (Counters{{"las_malformed", 1}}));      // version 1.9
  EXPECT_EQ(with(104, 11).counters, (Counters{{"las_malformed", 1}}));    // point format
  EXPECT_EQ(with(105, 27).counters, (Counters{{"las_malformed", 1}}));    // a point of 27 bytes
  EXPECT_EQ(with(138, 0xFF).counters, (Counters{{"las_malformed", 1}}));  // scale below 0
  EXPECT_EQ(with(104, 129).counters, (Counters{{"las_malformed", 1}}));   // compressed
}

// A record that is said to be longer than the head, first of 4 billion.
TEST(LasFile, NumbersOfRecordsThatCannotBeTakeNoTime) {
  ByteVector bytes = Las({{"epsg", 32632}, {"points", Points()}});
  for (const std::size_t at : {100, 101, 102, 103, 227 + 20, 227 + 21}) bytes[at] = 0xFF;
  const auto file = ReadLas(bytes);
  EXPECT_EQ(file.All<PlacedPing>().size(), 2u);
  EXPECT_EQ(ReadLasHead(bytes)->crs, "");
}

TEST(LasFile, AnyPiecesAndAnyDamage) {
  json points = json::array();
  for (int i = 0; i < 200; ++i) points.push_back({i, 2 * i, -30, 1000 + i, i % 9, i % 3, 0, 0});
  for (const int format : {1, 6})
    ExpectRobust(Las({{"version", 4}, {"format", format}, {"epsg", 32632}, {"points", points}}),
                 [] { return std::make_unique<LasFileReader>(std::make_unique<OneEach>()); });
}

// --- text ----------------------------------------------------------------------------------------

ByteVector BytesOfText(const std::string& text) { return {text.begin(), text.end()}; }

SurveyContents ReadXyz(const std::string& text, const XyzFormat& format) {
  XyzFileReader reader(format, std::make_unique<OneEach>());
  return ReadSurvey(BytesOfText(text), &reader);
}

TEST(XyzFile, ThreeNumbersByAnyDelimiterBehindAnyHeading) {
  for (const char* const text :
       {"X,Y,Z\n# a\n1.5,2.5,-3.5\nfoo\n4,5,6\n",
        "Easting;Northing;Depth\n1.5;2.5;-3.5\n4;;6\n4;5;6\n",
        "Rechts;Hoch;Tiefe\n1,5;2,5;-3,5\n4;;6\n4,0;5,0;6,0\n",
        "\"X\",\"Y\",\"Z\"\n\"1.5\",\"2.5\",\"-3.5\"\nfoo\n\"4\",\"5\",\"6\"\n",
        "  1.5\t2.5  -3.5 9\r\n4 5\n4 5 6\n"}) {
    const std::string all(text);
    const std::size_t first = all.find_first_of("0123456789");
    const auto file =
        ReadXyz(all, XyzFormat::For(all.substr(first, all.find('\n', first) - first)));
    const auto points = file.All<PlacedPing>();
    ASSERT_EQ(points.size(), 2u) << all;
    EXPECT_EQ(points[0].p_vehicle_origin_m, Eigen::Vector3d(1.5, 2.5, -3.5));
    EXPECT_EQ(points[1].p_vehicle_origin_m, Eigen::Vector3d(4, 5, 6));
    EXPECT_EQ(file.counters, (Counters{{"xyz_malformed", 1}}));
  }
}

TEST(TextTable, AMarkThatEnclosesNoFieldIsText) {
  using Fields = std::vector<std::string_view>;
  EXPECT_EQ(TextColumns("\"a,b\" , 12\",\"c\"d,\"e", ','),
            (Fields{"a,b", " 12\"", "\"c\"d", "\"e"}));
  EXPECT_EQ(TextColumns("\"a b\" c\t\"d", ' '), (Fields{"a b", "c", "\"d"}));
  EXPECT_EQ(TextColumns("a,,b,", ','), (Fields{"a", "", "b", ""}));
  EXPECT_EQ(TextColumns("", ' '), Fields{});
}

TEST(XyzFile, ColumnsOfTimeLineAndUse) {
  XyzFormat format;
  format.delimiter = ',';
  format.columns = {{"latitude", 1},
                    {"longitude", 0},
                    {"depth", 2, -1.0},
                    {"epoch", 3},
                    {"line", 4},
                    {"used", 5}};
  const auto file = ReadXyz(
      "11.5,57.5,-30,100.25,3,1\n11.5,57.5,-30,100.5,3,0\n11.5,57.5,-30,,3,1\n"
      "11.5,57.5,-30,100.5,-3,1\n",
      format);
  const auto points = file.All<PlacedPing>();
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].p_vehicle_origin_m, Eigen::Vector3d(11.5, 57.5, 30.0));
  EXPECT_EQ(ToUtime(points[0].time), 100'250'000);
  EXPECT_EQ(points[0].ping_number, 3u);
  EXPECT_EQ(file.counters, (Counters{{"xyz_malformed", 2}, {"xyz_points_not_used", 1}}));
}

TEST(XyzFile, ColumnsThatDoNotMakeASoundingAreRefused) {
  const auto problem = [](const std::vector<TextColumn>& columns) {
    XyzFormat format;
    format.columns = columns;
    return format.Validate();
  };
  EXPECT_EQ(problem({{"east", 0}, {"north", 1}, {"z", 2}}), "");
  EXPECT_EQ(problem({{"east", 0}, {"north", 1}, {"depth", 2}, {"height", 3}}),
            "one column gives the depth, the height or z");
  EXPECT_EQ(problem({{"east", 0}, {"z", 2}}),
            "columns give either east and north or longitude and latitude");
  EXPECT_EQ(problem({{"east", 0}, {"north", 1}, {"z", 2}, {"clock", 3}}),
            "the time is not complete");
  EXPECT_EQ(problem({{"roll", 0}}), "'roll' is no quantity of a column");
}

TEST(XyzFile, AnyPiecesAndAnyDamage) {
  std::string text = "x y z\n";
  for (int i = 0; i < 200; ++i)
    text += std::to_string(i) + " " + std::to_string(2 * i) + " -30.5\n";
  ExpectRobust(BytesOfText(text), [] {
    return std::make_unique<XyzFileReader>(XyzFormat::For("1 2 3"), std::make_unique<OneEach>());
  });
}

}  // namespace
}  // namespace seastitch
