#include <gtest/gtest.h>

#include "codecs/navigation/sbet_file.hpp"
#include "codecs/navigation/text_navigation.hpp"
#include "common/core/pose.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

std::filesystem::path Golden(const std::string& name) {
  return Shared("vectors/survey/nav/" + name);
}

SurveyContents ReadWith(Bytes bytes, const MakeReader& make) {
  const auto reader = make();
  return ReadSurvey(bytes, reader.get());
}

ByteVector ToBytes(const std::string& text) { return ByteVector(text.begin(), text.end()); }

// --- SBET -------------------------------------------------------------------------------------

constexpr std::int64_t kWeek2312 = 315'964'800 + 2312 * 604'800;  // Sunday of the golden file

MakeReader Sbet(int wander_sign = 0, bool velocity_up = false) {
  SbetParams params;
  params.week_start = FromUtime(kWeek2312 * 1'000'000);
  params.wander_sign = wander_sign;
  params.velocity_up = velocity_up;
  return [params] { return std::make_unique<SbetFileReader>(params); };
}

ByteVector SbetRow(double week_s, double latitude_rad = 1.0) {
  ByteWriter out;
  for (const double v : {week_s, latitude_rad, 0.2, 35.0, 2.0, 0.5, -0.25, 0.01, 0.02, 0.5, 0.3})
    out.Le(v);
  for (int i = 0; i < 6; ++i) out.Le(0.0);
  return out.Release();
}

TEST(SbetFile, GoldenRecords) {
  SKIP_WITHOUT(Golden("synthetic.sbet"));
  const auto golden = ReadJson(Golden("sbet_smrmsg.json"));
  const auto file = ReadWith(BytesOf(Golden("synthetic.sbet")), Sbet());
  const auto samples = file.All<NavigationRecord>();
  ASSERT_EQ(samples.size(), golden["sbet_rows"].size());
  EXPECT_EQ(ToUtime(samples[0].time),
            static_cast<std::int64_t>(golden["unix_first"].get<double>()) * 1'000'000);
  EXPECT_EQ((samples[1].time - samples[0].time).count(), 5000);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto row = golden["sbet_rows"][i].get<std::vector<double>>();
    EXPECT_EQ(samples[i].position->latitude_rad, row[1]);
    EXPECT_NEAR(samples[i].position->longitude_rad, row[2], 1e-15);
    EXPECT_EQ(*samples[i].height_m, row[3]);
    EXPECT_EQ(samples[i].velocity->v_ned_mps, Eigen::Vector3d(row[4], row[5], row[6]));
    EXPECT_LT((samples[i].attitude->q_ned_imu.toRotationMatrix() -
               RotationFromRpy(row[7], row[8], row[9]))
                  .norm(),
              1e-14);
  }
}

TEST(SbetFile, TheWanderAngleTurnsHeadingAndVelocityTogether) {
  const ByteVector row = SbetRow(1000.0);
  for (const int sign : {-1, 0, 1}) {
    const auto sample = ReadWith(row, Sbet(sign, true)).All<NavigationRecord>().at(0);
    const double turned_rad = 0.3 * sign;
    EXPECT_NEAR(RpyFromRotation(sample.attitude->q_ned_imu.toRotationMatrix()).z(),
                0.5 + turned_rad,
                1e-12);
    const Eigen::Vector3d expected =
        RotationFromRpy(0.0, 0.0, turned_rad) * Eigen::Vector3d(2.0, 0.5, 0.25);
    EXPECT_TRUE(sample.velocity->v_ned_mps.isApprox(expected, 1e-12));
  }
}

TEST(SbetFile, TimeRunsOnOverTheEndOfTheWeek) {
  ByteVector bytes = SbetRow(604'799.5);
  const ByteVector next = SbetRow(0.5);
  bytes.insert(bytes.end(), next.begin(), next.end());
  const auto samples = ReadWith(bytes, Sbet()).All<NavigationRecord>();
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ((samples[1].time - samples[0].time).count(), 1'000'000);
}

TEST(SbetFile, ARecordThatCannotBeAndAHalfOneAreCounted) {
  ByteVector bytes = SbetRow(1.0, 2.0);  // no such latitude
  const ByteVector good = SbetRow(2.0);
  bytes.insert(bytes.end(), good.begin(), good.end());
  bytes.insert(bytes.end(), good.begin(), good.begin() + 50);
  const auto file = ReadWith(bytes, Sbet());
  EXPECT_EQ(file.records.size(), 1u);
  EXPECT_EQ(file.counters, (Counters{{"damaged_bytes", 50}, {"sbet_malformed", 1}}));
  SbetParams params;
  params.wander_sign = 2;
  EXPECT_THROW(SbetFileReader{params}, std::invalid_argument);
}

TEST(SbetFile, AnyPiecesAndAnyDamage) {
  ByteVector bytes;
  for (int i = 0; i < 30; ++i) {
    const ByteVector row = SbetRow(1000.0 + i);
    bytes.insert(bytes.end(), row.begin(), row.end());
  }
  ExpectRobust(bytes, Sbet());
}

// --- text -------------------------------------------------------------------------------------

MakeReader Text(const TextNavigationFormat& format) {
  return [format] { return std::make_unique<TextNavigationReader>(format); };
}

TEST(TextNavigation, GoldenFilesOfMbSystem) {
  SKIP_WITHOUT(Golden("synthetic.fnv"));
  for (const auto& [name, format, latitude_deg, longitude_deg] :
       {std::tuple{"synthetic.fnv", TextNavigationFormat::Fnv(), 57.5, 11.25},
        std::tuple{"synthetic.na0", TextNavigationFormat::Na0(), 57.50001, 11.25002}}) {
    SCOPED_TRACE(name);
    const auto file = ReadWith(BytesOf(Golden(name)), Text(format));
    EXPECT_TRUE(file.counters.empty());
    const auto samples = file.All<NavigationRecord>();
    ASSERT_EQ(samples.size(), 3u);
    EXPECT_EQ(ToUtime(samples[0].time), 1'714'645'230'000'000);
    EXPECT_EQ(ToUtime(samples[2].time), 1'714'645'232'000'000);
    EXPECT_NEAR(Rad2Deg(samples[0].position->latitude_rad), latitude_deg, 1e-12);
    EXPECT_NEAR(Rad2Deg(samples[0].position->longitude_rad), longitude_deg, 1e-12);
    EXPECT_EQ(*samples[0].depth_m, 1.5);
    EXPECT_LT((samples[0].attitude->q_ned_imu.toRotationMatrix() -
               RotationFromRpy(Deg2Rad(2.0), Deg2Rad(-1.5), Deg2Rad(275.25)))
                  .norm(),
              1e-12);
  }
}

TextNavigationFormat Csv() {
  TextNavigationFormat format;
  format.source = "export";
  format.delimiter = ',';
  format.header_lines = 1;
  format.columns = {{"iso", 0},
                    {"east", 2},
                    {"north", 1},
                    {"depth", 3, -1.0},   // heights in the file
                    {"heading", 4, 0.9},  // gon
                    {"roll", 5, -1.0},
                    {"pitch", 6}};
  return format;
}

TEST(TextNavigation, ColumnsAreMappedByNameUnitAndSign) {
  const auto file = ReadWith(ToBytes("time,northing,easting,z,heading,roll,pitch\r\n"
                                     "2024-05-02T10:20:30.25Z,6375000.5,325000.25,-40.5,100,2,1\r\n"
                                     "\n# a remark\n"
                                     "2024-05-02 10:20:31,6375001,325001,,100,,\n"
                                     "2024-05-02T10:20:32.5Z,6375002,325002,-41"),
                             Text(Csv()));
  EXPECT_TRUE(file.counters.empty());
  const auto samples = file.All<NavigationRecord>();
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_EQ(ToUtime(samples[0].time), 1'714'645'230'250'000);
  EXPECT_EQ(*samples[0].grid_north_east_m, Eigen::Vector2d(6375000.5, 325000.25));
  EXPECT_EQ(*samples[0].depth_m, 40.5);
  EXPECT_LT((samples[0].attitude->q_ned_imu.toRotationMatrix() -
             RotationFromRpy(Deg2Rad(-2.0), Deg2Rad(1.0), Deg2Rad(90.0)))
                .norm(),
            1e-12);
  // Empty is not zero.
  EXPECT_FALSE(samples[1].depth_m);
  EXPECT_FALSE(samples[1].attitude);
  EXPECT_NEAR(*samples[1].heading_rad, Deg2Rad(90.0), 1e-12);
  EXPECT_EQ(*samples[2].depth_m, 41.0);
  EXPECT_FALSE(samples[2].heading_rad);
}

TEST(TextNavigation, OneInstantIsWrittenInManyForms) {
  for (const std::string time : {"2024-05-02T10:20:30.25Z",
                                 "2024-05-02 10:20:30.25",
                                 "\"2024-05-02T10:20:30.25\"",
                                 "2024-05-02T10:20:30.25+00:00",
                                 "2024-05-02T12:20:30.25+02:00",
                                 "2024-05-02T06:50:30.25-0330",
                                 "2024-05-03T00:20:30.25+14",
                                 "20240502T102030.25Z"}) {
    const auto file = ReadWith(ToBytes("header\n" + time + ",1,2,3,4,5,6\n"), Text(Csv()));
    ASSERT_EQ(file.records.size(), 1u) << time;
    EXPECT_EQ(ToUtime(file.All<NavigationRecord>().at(0).time), 1'714'645'230'250'000) << time;
  }
  for (const std::string time : {"2024-05-02T10:20:30+15:00",
                                 "2024-05-02T10:20:30+2",
                                 "2024-05-02T10:20:30+",
                                 "2024-05-02T1020Z",
                                 "240502T102030Z"})
    EXPECT_TRUE(
        ReadWith(ToBytes("header\n" + time + ",1,2,3,4,5,6\n"), Text(Csv())).records.empty())
        << time;
}

TEST(TextNavigation, OnePlaceIsWrittenInManyForms) {
  TextNavigationFormat format;
  format.delimiter = ';';
  format.columns = {{"epoch", 0}, {"latitude", 1}, {"longitude", 2}};
  const auto read = [&](const std::string& latitude, const std::string& longitude) {
    return ReadWith(ToBytes("1000;" + latitude + ";" + longitude + "\n"), Text(format));
  };
  for (const auto& [latitude, longitude] :
       std::vector<std::pair<std::string, std::string>>{{"-33.51", "71.62"},
                                                        {"-33,51", "71,62"},
                                                        {"\"-33.51\"", "+71.62"},
                                                        {"33.51S", "71.62E"},
                                                        {"S 33 30.6", "E71 37.2"},
                                                        {"33\u00b030.6'S", "71\u00b037.2'E"},
                                                        {"33d30m36s S", "71 37 12 e"},
                                                        {"-33d30m36s", "71d37m12s"},
                                                        {"33d30'36\"S", "71d37'12\"E"},
                                                        {"-33 30.6", "71 37.2"}}) {
    const auto file = read(latitude, longitude);
    ASSERT_EQ(file.records.size(), 1u) << latitude;
    const GeoPosition place = *file.All<NavigationRecord>().at(0).position;
    EXPECT_NEAR(Rad2Deg(place.latitude_rad), -33.51, 1e-9) << latitude;
    EXPECT_NEAR(Rad2Deg(place.longitude_rad), 71.62, 1e-9) << longitude;
  }
  for (const char* const wrong : {"33 60.5 S", "33.51E", "33 30.6 36 1 S", "north", "S", "-33 -30"})
    EXPECT_TRUE(read(wrong, "71.62").records.empty()) << wrong;
}

TEST(TextNavigation, TheFirstLineThatCannotBeReadIsNamed) {
  TextNavigationReader reader(Csv());
  const ByteVector bytes = ToBytes(
      "header\n2024-05-02T10:20:30Z,1,2,3,4,5,6\n2024-05-02T10:20:31Z,1,2,x,4,5,6\n"
      "soon,1,2,3,4,5,6\n");
  reader.Add(bytes);
  EXPECT_EQ(reader.problem(), "line 3: column 4 holds 'x', expected a number such as 12.5");
}

TEST(TextNavigation, LinesThatAreNoneAndTimeThatFallsAreCounted) {
  const auto file = ReadWith(ToBytes("header\n"
                                     "2024-05-02T10:20:31,1,2,3,4,5,6\n"
                                     "2024-05-02T10:20:31,1,2,3,4,5,6\n"
                                     "2024-05-02T10:20:30,1,2,3,4,5,6\n"
                                     "2024-05-02T10:20:32,north,2,3,4,5,6\n"
                                     "2024-13-02T10:20:33,1,2,3,4,5,6\n"
                                     "2024-05-02T10:20:34,1,,3,4,5,6\n"
                                     "2024-05-02T10:20:35,nan,2,3,4,5,6\n"
                                     "2024-05-02T25:20:36,1,2,3,4,5,6\n"),
                             Text(Csv()));
  EXPECT_EQ(file.records.size(), 1u);
  EXPECT_EQ(file.counters, (Counters{{"text_malformed", 5}, {"text_time_not_rising", 2}}));
}

// Stamps of whole seconds, several lines a second: only a line that goes back is late.
TEST(TextNavigation, LinesOfOneTimeAreNotLate) {
  const auto reader = Text(Csv())();
  ReadSurvey(ToBytes("2024-05-02T10:20:31,1,2,3,4,5,6\n"
                     "2024-05-02T10:20:31,1,2,3,4,5,6\n"
                     "2024-05-02T10:20:30,1,2,3,4,5,6\n"),
             reader.get());
  EXPECT_EQ(reader->late(), 1);
}

TEST(TextNavigation, ALineWithoutAnEndIsBounded) {
  ByteVector bytes(100'000, 'x');
  const auto file = ReadWith(bytes, Text(Csv()));
  EXPECT_TRUE(file.records.empty());
  EXPECT_GT(file.counters.at("damaged_bytes"), 90'000);
}

TEST(TextNavigation, AFormatWithoutTimeOrPlaceIsRefusedInOneLine) {
  TextNavigationFormat format;
  EXPECT_EQ(format.Validate(), "no column gives the time");
  format.columns = {{"epoch", 0}};
  EXPECT_EQ(format.Validate(), "no columns give the position");
  format.columns = {{"epoch", 0}, {"latitude", 1}, {"longitude", 2}};
  EXPECT_EQ(format.Validate(), "");
  format.columns.push_back({"latitude", 4});
  EXPECT_EQ(format.Validate(), "latitude stands in two columns");
  format.columns.back() = {"lattitude", 4};
  EXPECT_EQ(format.Validate(), "'lattitude' is no quantity of a column");
  EXPECT_THROW(TextNavigationReader{format}, std::invalid_argument);
}

TEST(TextNavigation, AnyPiecesAndAnyDamage) {
  std::string text = "time,northing,easting,z,heading,roll,pitch\n";
  for (int i = 10; i < 60; ++i)
    text += "2024-05-02T10:20:" + std::to_string(i) + ",6375000.5,325000.25,-40.5,100,2,1\n";
  ExpectRobust(ToBytes(text), Text(Csv()));
}

}  // namespace
}  // namespace seastitch
