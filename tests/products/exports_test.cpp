#include <gmock/gmock.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "products/files/navigation_files.hpp"
#include "products/track/survey_lines.hpp"
#include "products/write_products.hpp"
#include "tests/products/synthetic_survey.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"

// What is exported, read by readers that are not ours: a script from the formats' descriptions,
// and GDAL.
namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::Collect;
using ::testing::HasSubstr;
using testing::LoopEdge;
using testing::MakeDriftingSurvey;
using testing::SolutionAt;

constexpr Datum kDatum{57.1, 11.2};

nlohmann::json ReadBy(const std::string& kind, const fs::path& file) {
  const auto script = fs::path(SourceDir()) / "tests/products/read_exports.py";
  const auto read = RunCommand("python3 " + script.string() + " " + kind + " " + file.string());
  EXPECT_EQ(read.exit_code, 0) << read.output;
  return read.exit_code == 0 ? nlohmann::json::parse(read.output) : nlohmann::json();
}

// A survey of three lines, solved to its truth, with two pings of three beams in every submap.
class Exports : public ::testing::Test {
 protected:
  Exports() : drifting_(MakeDriftingSurvey()) {
    survey_ = Collect(drifting_, folder_.path(), SolutionAt(drifting_.truth), {LoopEdge(0, 5)});
    for (std::size_t i = 2; i < survey_.submaps.size(); i += 3)
      survey_.submaps[i].trigger = SubmapTrigger::kTurn;
    const auto at = [this](std::size_t i) { return survey_.submaps[i]; };
    survey_.inputs = {{"a, first.all", at(0).start, at(4).end}, {"b.all", at(5).start, at(8).end}};
    for (const SurveySubmap& s : survey_.submaps) {
      SubmapSoundings soundings;
      soundings.id = s.id;
      soundings.pings = {{s.start, 1000u + static_cast<std::uint32_t>(s.id.value), 0},
                         {s.end, 2000u + static_cast<std::uint32_t>(s.id.value), 1}};
      for (std::uint32_t ping = 0; ping < 2; ++ping)
        for (std::uint16_t beam = 0; beam < 3; ++beam)
          soundings.soundings.push_back(
              {{ping == 0 ? -5.0f : 5.0f, 3.0f * (static_cast<float>(beam) - 1.0f), 12.0f},
               ping,
               beam,
               beam != 2});
      const std::uint16_t input = s.id.value < 5 ? 0 : 1;
      log_.Add(soundings, {input, input});
    }
    options_.datum = kDatum;
    options_.soundings = &log_;
    options_.sounding_format = SoundingFormat::kLas;
  }

  ProductSummary Write() { return WriteProducts(survey_, options_, folder_.path()); }
  fs::path Export(const char* name) const { return folder_.path() / "export" / name; }

  TemporaryDir folder_;
  testing::DriftingSurvey drifting_;
  Survey survey_;
  ProductOptions options_;
  SoundingLog log_{folder_.path() / ".soundings"};
};

TEST_F(Exports, NavigationIsTheCorrectedTrackInEveryFormat) {
  ASSERT_EQ(Write().outcome, Outcome::kCorrected);
  const nlohmann::json sbet = ReadBy("sbet", Export("navigation.sbet"));
  const nlohmann::json na0 = ReadBy("na0", Export("navigation.na0"));
  ASSERT_EQ(sbet.size(), survey_.track.size());
  ASSERT_EQ(na0.size(), survey_.track.size());
  const GeographicLib::LocalCartesian map(kDatum.latitude_deg, kDatum.longitude_deg, 0.0);
  double worst_m = 0.0, worst_mps = 0.0;
  for (std::size_t i = 0; i < sbet.size(); ++i) {
    // 2023-11-14 22:13:20 UTC is 252,818 s into a GPS week.
    EXPECT_NEAR(double(sbet[i]["week_s"]),
                252'818.0 + ToSeconds(survey_.track[i].time - survey_.track[0].time),
                1e-6);
    EXPECT_NEAR(double(na0[i]["epoch_s"]), 1e-6 * double(ToUtime(survey_.track[i].time)), 1e-6);
    EXPECT_NEAR(Rad2Deg(sbet[i]["latitude_rad"]), double(na0[i]["latitude"]), 1e-9);
    EXPECT_NEAR(Rad2Deg(sbet[i]["longitude_rad"]), double(na0[i]["longitude"]), 1e-9);
    EXPECT_NEAR(Rad2Deg(sbet[i]["heading_rad"]), double(na0[i]["heading"]), 1e-4);
    EXPECT_NEAR(sbet[i]["height_m"], -28.0, 1e-9);
    EXPECT_NEAR(na0[i]["draft"], 28.0, 1e-9);
    double x = 0.0, y = 0.0, z = 0.0;
    map.Forward(na0[i]["latitude"], na0[i]["longitude"], -28.0, x, y, z);
    const Eigen::Vector3d truth = drifting_.true_track[i].T_map_vehicle.translation();
    worst_m = std::max(worst_m, std::hypot(y - truth.x(), x - truth.y()));
    // 24 m of line in 30 s.
    if (i % 60 != 0 && i % 60 != 59)
      worst_mps = std::max(
          worst_mps,
          std::abs(std::hypot(double(sbet[i]["v_north"]), double(sbet[i]["v_east"])) - 0.8));
  }
  EXPECT_LT(worst_m, 0.4);  // between frames corrections are blended
  EXPECT_LT(worst_mps, 0.1);
}

// MB-System and readers of SBET drop what does not rise in time.
TEST_F(Exports, NavigationOfSeveralDivesIsInOrderOfTimeWhateverTheirOrder) {
  // The later half is given first.
  const auto half = static_cast<std::ptrdiff_t>(survey_.track.size() / 2);
  std::rotate(survey_.track.begin(), survey_.track.begin() + half, survey_.track.end());
  for (std::size_t i = 0; i < survey_.track.size(); ++i)
    survey_.track[i].chain = 2 * i < survey_.track.size() ? 0 : 1;
  survey_.dives = {"day 2", "day 1"};
  Write();
  const nlohmann::json sbet = ReadBy("sbet", Export("navigation.sbet"));
  const nlohmann::json na0 = ReadBy("na0", Export("navigation.na0"));
  ASSERT_EQ(sbet.size(), survey_.track.size());
  for (std::size_t i = 1; i < sbet.size(); ++i) {
    ASSERT_GT(double(sbet[i]["week_s"]), double(sbet[i - 1]["week_s"])) << i;
    ASSERT_GT(double(na0[i]["epoch_s"]), double(na0[i - 1]["epoch_s"])) << i;
  }
  EXPECT_FALSE(fs::exists(Export("navigation_1.sbet")));
}

// Two vehicles at the same time.
TEST_F(Exports, NavigationOfDivesThatOverlapInTimeIsAFileOfEach) {
  const std::size_t half = survey_.track.size() / 2;
  for (std::size_t i = half; i < survey_.track.size(); ++i) {
    survey_.track[i].chain = 1;
    survey_.track[i].time = survey_.track[i - half].time + FromSeconds(1.25);
  }
  survey_.dives = {"a", "b"};
  Write();
  EXPECT_FALSE(fs::exists(Export("navigation.sbet")));
  EXPECT_EQ(ReadBy("sbet", Export("navigation_1.sbet")).size(), half);
  EXPECT_EQ(ReadBy("na0", Export("navigation_2.na0")).size(), survey_.track.size() - half);
  EXPECT_TRUE(fs::exists(Export("navigation_2.csv")));
}

TEST_F(Exports, NavigationCsvIsReadByGdal) {
  Write();
  const auto info = RunCommand(
      "ogrinfo -ro -al -so -oo X_POSSIBLE_NAMES=longitude_deg -oo "
      "Y_POSSIBLE_NAMES=latitude_deg -oo AUTODETECT_TYPE=YES " +
      Export("navigation.csv").string());
  ASSERT_EQ(info.exit_code, 0) << info.output;
  EXPECT_THAT(info.output, HasSubstr("Feature Count: " + std::to_string(survey_.track.size())));
  EXPECT_THAT(info.output, HasSubstr("Geometry: Point"));
  EXPECT_THAT(info.output, HasSubstr("Extent: (11.199"));
  EXPECT_THAT(info.output, HasSubstr("time: DateTime"));
}

TEST_F(Exports, SoundingsStandWhereTheirSubmapsDo) {
  ASSERT_EQ(Write().outcome, Outcome::kCorrected);
  const nlohmann::json las = ReadBy("las", Export("soundings.las"));
  EXPECT_THAT(std::string(las["wkt"]), HasSubstr("UTM zone 32N"));
  const nlohmann::json& points = las["points"];
  ASSERT_EQ(points.size(), 6 * survey_.submaps.size());
  const GeographicLib::LocalCartesian map(kDatum.latitude_deg, kDatum.longitude_deg, 0.0);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const SurveySubmap& submap = survey_.submaps[k / 6];
    const bool second = k % 6 >= 3;
    const int beam = static_cast<int>(k % 3);
    const Eigen::Vector2d p =
        drifting_.truth[k / 6] * Eigen::Vector2d(second ? 5.0 : -5.0, 3.0 * (beam - 1));
    const double down_m = submap.T_map_submap.translation().z() + 12.0;
    double latitude = 0, longitude = 0, height = 0, x = 0, y = 0;
    map.Reverse(p.y(), p.x(), -down_m, latitude, longitude, height);
    int zone = 0;
    bool north = false;
    GeographicLib::UTMUPS::Forward(latitude, longitude, zone, north, x, y, 32);
    EXPECT_NEAR(points[k]["x"], x, 2e-3);
    EXPECT_NEAR(points[k]["y"], y, 2e-3);
    EXPECT_NEAR(points[k]["z"], -down_m, 2e-3);
    EXPECT_EQ(points[k]["ping"], (second ? 2000 : 1000) + submap.id.value);
    EXPECT_EQ(points[k]["beam"], beam);
    EXPECT_EQ(points[k]["head"], second ? 1 : 0);
    EXPECT_EQ(points[k]["file"], k / 6 < 5 ? 1 : 2);
    EXPECT_EQ(points[k]["line"], 1 + static_cast<int>(k) / 18);
    EXPECT_EQ(points[k]["class"], beam == 2 ? 7 : 40);
    EXPECT_EQ(points[k]["withheld"], beam == 2);
    EXPECT_NEAR(
        points[k]["unix_s"], 1e-6 * double(ToUtime(second ? submap.end : submap.start)), 1e-5);
  }
  EXPECT_EQ(TextOf(Export("files.csv")), "file,name\n1,\"a, first.all\"\n2,b.all\n");
  EXPECT_FALSE(fs::exists(Export("soundings.las.partial")));
}

TEST_F(Exports, SoundingsAsTextAreTheSame) {
  options_.sounding_format = SoundingFormat::kXyz;
  Write();
  std::istringstream in(TextOf(Export("soundings.xyz")));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "# longitude latitude depth_m time file line ping head beam used");
  const GeographicLib::LocalCartesian map(kDatum.latitude_deg, kDatum.longitude_deg, 0.0);
  std::size_t k = 0;
  for (double longitude = 0, latitude = 0, depth = 0; in >> longitude >> latitude >> depth; ++k) {
    std::string time;
    int file = 0, survey_line = 0, ping = 0, head = 0, beam = 0, used = 0;
    in >> time >> file >> survey_line >> ping >> head >> beam >> used;
    double east = 0, north = 0, up = 0;
    map.Forward(latitude, longitude, -depth, east, north, up);
    const Eigen::Vector2d p =
        drifting_.truth[k / 6] * Eigen::Vector2d(k % 6 >= 3 ? 5.0 : -5.0, 3.0 * (beam - 1));
    EXPECT_NEAR(north, p.x(), 2e-3);
    EXPECT_NEAR(east, p.y(), 2e-3);
    EXPECT_EQ(beam, static_cast<int>(k % 3));
    EXPECT_EQ(survey_line, 1 + static_cast<int>(k) / 18);
    EXPECT_EQ(time.size(), 27u);
  }
  EXPECT_EQ(k, 6 * survey_.submaps.size());
}

TEST_F(Exports, LinesSayByHowMuchTheyWereMoved) {
  Write();
  std::istringstream in(TextOf(Export("lines.csv")));
  std::string line;
  std::getline(in, line);
  std::vector<std::string> lines;
  while (std::getline(in, line)) lines.push_back(line);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_THAT(lines[0], ::testing::StartsWith("1,\"a, first.all\",2023-11-14T22:13:20.000000Z,"));
  EXPECT_THAT(lines[2], ::testing::StartsWith("3,b.all,"));
  // The third, by hand: the mean over its submaps.
  Eigen::Vector2d moved = Eigen::Vector2d::Zero();
  for (std::size_t i = 6; i < 9; ++i)
    moved += (drifting_.truth[i].Translation() -
              LevelPose(survey_.submaps[i].T_map_submap).Translation()) /
             3.0;
  std::vector<std::string> fields;
  std::istringstream of_line(lines[2]);
  for (std::string field; std::getline(of_line, field, ',');) fields.push_back(field);
  ASSERT_EQ(fields.size(), 16u);
  // 59 steps of 0.4 m in each of three submaps; the track drifts between them.
  EXPECT_NEAR(std::stod(fields[15]), 3 * 59 * 0.4, 4.0);
  EXPECT_EQ(fields[4], "3");
  EXPECT_NEAR(std::stod(fields[7]), moved.x(), 1e-3);
  EXPECT_NEAR(std::stod(fields[8]), moved.y(), 1e-3);
  EXPECT_EQ(fields[12], "0.200");
  EXPECT_EQ(fields[13], "0.300");
}

// A turn with the sonar on.
TEST_F(Exports, ARunOfSubmapsThatIsATurnIsNoLine) {
  for (TrackState& state : survey_.track) {
    const double s = ToSeconds(state.time - survey_.submaps[3].start);
    if (s >= 0.0 && s < 90.0) state.rpy_rad.z() += Deg2Rad(3.0) * s;
  }
  Write();
  const std::string text = TextOf(Export("lines.csv"));
  EXPECT_THAT(text, HasSubstr("\n1,"));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("\n2,")));
  EXPECT_THAT(text, HasSubstr("\n3,"));
}

// The shallowest of the used ones: the third beam is left out.
TEST_F(Exports, TheShoalestSoundingOfEachCellIsAUsedOne) {
  options_.cell_m = 1.0;
  Write();
  const auto text = RunCommand("gdal_translate -q -of XYZ " +
                               (folder_.path() / "shoalest.tif").string() + " /vsistdout/");
  ASSERT_EQ(text.exit_code, 0) << text.output;
  std::istringstream in(text.output);
  std::size_t cells = 0;
  for (double x = 0, y = 0, z = 0; in >> x >> y >> z;) {
    if (z < -9000.0) continue;
    ++cells;
    EXPECT_NEAR(z, -40.0, 4.0);
  }
  EXPECT_GT(cells, survey_.submaps.size());
  EXPECT_LE(cells, 4 * survey_.submaps.size());
}

TEST_F(Exports, WithoutADatumThereIsNoNavigationOnTheEllipsoid) {
  options_.datum.reset();
  Write();
  EXPECT_FALSE(fs::exists(Export("navigation.csv")));
  EXPECT_TRUE(fs::exists(Export("lines.csv")));
  const nlohmann::json las = ReadBy("las", Export("soundings.las"));
  EXPECT_EQ(las["wkt"], "");
}

TEST_F(Exports, SoundingsOfASubmapThatTheSurveyLacksAreLeftOut) {
  SubmapSoundings unknown;
  unknown.id.value = 77;
  unknown.pings = {{Time{}, 1, 0}};
  unknown.soundings = {{{0, 0, 0}, 0, 0, true}};
  log_.Add(unknown, {0});
  Write();
  EXPECT_EQ(ReadBy("las", Export("soundings.las"))["points"].size(), 6 * survey_.submaps.size());
}

TEST(NavigationFiles, GpsTimeHasTheLeapSecondsOfItsDay) {
  const auto at = [](std::int64_t s) { return FromUtime(s * 1'000'000); };
  EXPECT_EQ(GpsSeconds(at(315'964'800)), 0.0);
  EXPECT_EQ(GpsSeconds(at(1'483'228'799)), 1'483'228'799.0 - 315'964'800.0 + 17.0);  // 2016
  EXPECT_EQ(GpsSeconds(at(1'483'228'800)), 1'483'228'800.0 - 315'964'800.0 + 18.0);  // 2017
  EXPECT_EQ(IsoTime(at(1'483'228'799) + FromSeconds(0.999999)), "2016-12-31T23:59:59.999999Z");
}

}  // namespace
}  // namespace seastitch
