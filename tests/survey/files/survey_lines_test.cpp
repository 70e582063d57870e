// Soundings by line with a track beside them: files of a survey whose soundings are known, through
// plan, messages, navigation and geometry to the map. LAS is written by a script from the format's
// description, the grid by GeographicLib.

#include <gmock/gmock.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/message_types.hpp"
#include "tests/codecs/survey_files.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/paths.hpp"
#include "tests/process/run_command.hpp"
#include "tests/property.hpp"
#include "tests/runtime/temporary_dir.hpp"
#include "tests/survey/files/placed_pings.hpp"
#include "tests/survey/files/read_all.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNoon_s = 1'777'723'200.0;  // 2026-05-02T12:00:00Z
constexpr double kLatitude = 57.1, kLongitude = 11.2;

struct Point {
  double t_s;               // since noon
  Eigen::Vector3d p_ned_m;  // about kLatitude, kLongitude; below the water line
  int line;
};

// A vehicle at 20 m of depth on three lines of 150 m, 30 m apart, to and fro at 2 m/s, with turns
// of 20 s. Its swath reaches 45 m to each side: over the lines beside it.
struct Vehicle {
  Eigen::Vector2d p_m;
  double heading_rad;
};
constexpr double kLineS = 75.0, kTurnS = 20.0;

Vehicle VehicleAt(double t_s) {
  const int line = std::clamp(static_cast<int>(t_s / (kLineS + kTurnS)), 0, 2);
  const double s = t_s - line * (kLineS + kTurnS);
  const double sign = line % 2 == 0 ? 1.0 : -1.0;
  const double begin = line % 2 == 0 ? 0.0 : 150.0;
  if (s <= kLineS || line == 2)
    return {{begin + sign * 2.0 * s, 30.0 * line + std::sin(0.05 * s)},
            sign > 0 ? 0.1 * std::sin(0.05 * s) : kPi - 0.1 * std::sin(0.05 * s)};
  const double angle = kPi * (s - kLineS) / kTurnS;
  const double from = 30.0 * line + std::sin(0.05 * kLineS);
  const double end = begin + sign * 150.0;
  return {{end + sign * 15.0 * std::sin(angle),
           from + 15.0 * (1.0 - std::cos(angle)) - std::sin(0.05 * kLineS) * angle / kPi},
          sign > 0 ? angle : kPi + angle};
}

std::vector<Point> Soundings() {
  std::vector<Point> points;
  for (int line = 0; line < 3; ++line)
    for (int ping = 0; ping < 150; ++ping) {
      const double t_s = line * (kLineS + kTurnS) + 0.5 * ping + 0.01;
      const Vehicle v = VehicleAt(t_s);
      for (int beam = -15; beam <= 15; ++beam) {
        const Eigen::Vector2d off =
            3.0 * beam * Eigen::Vector2d(-std::sin(v.heading_rad), std::cos(v.heading_rad));
        const Eigen::Vector2d p = v.p_m + off;
        points.push_back(
            {t_s, {p.x(), p.y(), 50.0 + std::sin(0.1 * p.x()) * std::cos(0.08 * p.y())}, line});
      }
    }
  return points;
}

const GeographicLib::LocalCartesian& Local() {
  static const GeographicLib::LocalCartesian local(kLatitude, kLongitude, 0.0);
  return local;
}
// Longitude, latitude.
Eigen::Vector2d Geographic(const Eigen::Vector2d& p_m) {
  double latitude = 0.0, longitude = 0.0, height = 0.0;
  Local().Reverse(p_m.y(), p_m.x(), 0.0, latitude, longitude, height);
  return {longitude, latitude};
}
Eigen::Vector2d Utm(const Eigen::Vector2d& p_m) {
  const Eigen::Vector2d place = Geographic(p_m);
  int zone = 0;
  bool north = false;
  double x = 0.0, y = 0.0;
  GeographicLib::UTMUPS::Forward(place.y(), place.x(), zone, north, x, y, 32);
  return {x, y};
}

struct TrackColumns {
  bool heading = true, attitude = true, depth = true, grid = false;
  double step_s = 0.2;
};

class SurveyLines : public ::testing::Test {
 protected:
  using Pick = std::function<bool(const Point&)>;
  static bool All(const Point&) { return true; }

  // Columns of numbers.
  fs::path Track(const TrackColumns& with = {}, double late_s = 0.0) {
    std::ostringstream text;
    text.precision(15);
    for (int i = 0; i * with.step_s <= 275.0; ++i) {
      const double t_s = -5.0 + with.step_s * i + 0.1 * with.step_s * (i % 2);
      const Vehicle v = VehicleAt(t_s);
      const Eigen::Vector2d p = with.grid ? Utm(v.p_m) : Geographic(v.p_m);
      text << kNoon_s + t_s + late_s << ',' << p.x() << ',' << p.y() << ",20,"
           << Rad2Deg(v.heading_rad) << ",1,2\n";
    }
    const std::string file = dir_.Write("track.csv", text.str());
    std::string columns = "columns:\n  - {quantity: epoch, column: 1}\n";
    const auto add = [&columns](const std::string& quantity, int column) {
      columns += "  - {quantity: " + quantity + ", column: " + std::to_string(column) + "}\n";
    };
    add(with.grid ? "east" : "longitude", 2);
    add(with.grid ? "north" : "latitude", 3);
    if (with.depth) add("depth", 4);
    if (with.heading) add("heading", 5);
    if (with.attitude) add("roll", 6), add("pitch", 7);
    dir_.Write("track.csv.yaml", columns + (with.grid ? "crs: EPSG:32632\n" : ""));
    return file;
  }

  enum class Times { kAdjusted, kWeek, kUtc };
  fs::path Las(const std::string& name,
               json spec,
               const Pick& pick = All,
               Times times = Times::kAdjusted,
               std::vector<Point> points = Soundings()) {
    json list = json::array();
    for (const Point& point : points) {
      if (!pick(point)) continue;
      const Eigen::Vector2d p = Utm(point.p_ned_m.head<2>());
      double gps_s = kNoon_s + point.t_s - 315'964'800.0;
      if (times != Times::kUtc) gps_s += 18.0;
      const double time_s = times == Times::kWeek ? std::fmod(gps_s, 604'800.0) : gps_s - 1e9;
      list.push_back({p.x(), p.y(), -point.p_ned_m.z(), time_s, 2, point.line + 1, 0, 0});
    }
    spec["points"] = list;
    spec["offset"] = {650'000.0, 6'330'000.0, 0.0};
    spec["adjusted"] = times != Times::kWeek;
    if (!spec.contains("epsg") && !spec.contains("none")) spec["epsg"] = 32632;
    const std::string input = dir_.Write("in.json", spec.dump());
    const fs::path file = dir_.path() / name;
    const auto written =
        RunCommand("python3 " + (SourceDir() / "tests/codecs/write_las.py").string() + " " +
                   file.string() + " < " + input);
    EXPECT_EQ(written.exit_code, 0) << written.output;
    return file;
  }

  CommandResult Replay(const std::string& inputs) const {
    return RunCommand(Program("seastitch") + " replay --quiet " + inputs + " --out " +
                      (dir_.path() / "map").string());
  }
  // One line and exit code 65.
  void ExpectRefused(const std::vector<fs::path>& files, const std::string& why) const {
    std::string inputs;
    for (const fs::path& file : files) inputs += " " + file.string();
    const auto result = Replay(inputs);
    EXPECT_EQ(result.exit_code, 65) << result.output;
    EXPECT_THAT(result.output, HasSubstr(why));
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }

  TemporaryDir dir_;
};

struct Sounded {
  double t_s;
  Eigen::Vector3d p_ned_m;  // about kLatitude, kLongitude
};

struct Mapping {
  std::string text;
  Counters counters;
  std::vector<Sounded> soundings;
};

// Soundings as navigation and geometry of the mapper place them.
Mapping MappingOf(const std::vector<fs::path>& files) {
  PlacedSurvey placed = PlaceSurvey(files);
  const GeographicLib::LocalCartesian map(
      placed.datum_latitude_deg, placed.datum_longitude_deg, 0.0);
  Mapping mapping{std::move(placed.text), std::move(placed.counters), {}};
  for (const PlacedSoundings& ping : placed.pings)
    for (const Eigen::Vector3d& p : ping.p_map_m) {
      double latitude = 0.0, longitude = 0.0, height = 0.0, x = 0.0, y = 0.0, z = 0.0;
      map.Reverse(p.y(), p.x(), 0.0, latitude, longitude, height);
      Local().Forward(latitude, longitude, 0.0, x, y, z);
      mapping.soundings.push_back(
          {1e-6 * static_cast<double>(ToUtime(ping.time)) - kNoon_s, {y, x, p.z()}});
    }
  return mapping;
}

struct Errors {
  double worst_m = 0.0;
  double worst_s = 0.0;
  double median_s = 0.0;
};

// The mapped soundings against the points that they are nearest to: each once, and this share of
// all.
Errors ExpectMapped(const Mapping& mapping, const std::vector<Point>& points, double share = 1.0) {
  Errors errors;
  std::vector<double> off_s;
  std::vector<bool> found(points.size(), false);
  for (const Sounded& sounded : mapping.soundings) {
    const auto nearest =
        std::min_element(points.begin(), points.end(), [&](const Point& a, const Point& b) {
          return (a.p_ned_m - sounded.p_ned_m).squaredNorm() <
                 (b.p_ned_m - sounded.p_ned_m).squaredNorm();
        });
    errors.worst_m = std::max(errors.worst_m, (nearest->p_ned_m - sounded.p_ned_m).norm());
    off_s.push_back(std::abs(nearest->t_s - sounded.t_s));
    found[static_cast<std::size_t>(nearest - points.begin())] = true;
  }
  const auto distinct = std::count(found.begin(), found.end(), true);
  EXPECT_GE(static_cast<double>(distinct), share * static_cast<double>(points.size()))
      << mapping.text;
  EXPECT_EQ(static_cast<std::size_t>(distinct), mapping.soundings.size());
  if (off_s.empty()) return errors;
  errors.worst_s = *std::max_element(off_s.begin(), off_s.end());
  errors.median_s = Median(off_s);
  return errors;
}

std::vector<Point> OfLine(int line) {
  std::vector<Point> points = Soundings();
  std::erase_if(points, [line](const Point& point) { return point.line != line; });
  return points;
}

// The only errors are the millimetres of the LAS file and those of the track between its records:
// 0.2 s in turns and waves.
constexpr double kTolerance_m = 0.006;

TEST_F(SurveyLines, TimedLasIsMappedWhereItsSoundingsAre) {
  const Mapping mapping = MappingOf({Las("a.las", {{"version", 4}, {"format", 6}}), Track()});
  EXPECT_THAT(mapping.text, HasSubstr("a.las: WGS 84 / UTM zone 32N; GPS time; z up"));
  const Errors errors = ExpectMapped(mapping, Soundings());
  EXPECT_LT(errors.worst_m, kTolerance_m);
  EXPECT_LT(errors.worst_s, 1e-3);
  EXPECT_EQ(mapping.counters.at("survey_pings"), 450);
  EXPECT_EQ(mapping.counters.at("line_points_used"), 450 * 31);
}

TEST_F(SurveyLines, SecondsOfTheWeekTakeTheirWeekFromTheTrack) {
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}, All, Times::kWeek), Track()});
  EXPECT_THAT(mapping.text, HasSubstr("seconds of the GPS week"));
  EXPECT_LT(ExpectMapped(mapping, Soundings()).worst_s, 1e-3);
}

// An export setting: 18 s, which the soundings show, 36 m along the line.
TEST_F(SurveyLines, TimesInUtcAreFoundOut) {
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}, All, Times::kUtc), Track()});
  EXPECT_THAT(mapping.text, HasSubstr("UTC"));
  const Errors errors = ExpectMapped(mapping, Soundings());
  EXPECT_LT(errors.worst_s, 1e-3);
  EXPECT_LT(errors.worst_m, kTolerance_m);
}

// The outer beams lie on the track of the next line, and must not be taken for its soundings. The
// vehicle crabs by up to 6 degrees: its outer beams are up to 5 m ahead of the nearest place or
// behind.
TEST_F(SurveyLines, WithoutTimesEachLineIsPlacedByItsOwnPartOfTheTrack) {
  for (int line = 0; line < 3; ++line) {
    const auto is_line = [line](const Point& point) { return point.line == line; };
    const Mapping mapping = MappingOf({Las("a.las", {{"format", 0}}, is_line), Track()});
    EXPECT_THAT(mapping.text, HasSubstr("nearest place"));
    const Errors errors = ExpectMapped(mapping, OfLine(line), 0.99);
    EXPECT_LT(errors.worst_m, kTolerance_m) << line;
    EXPECT_LT(errors.median_s, 1.0) << line;
    EXPECT_LT(errors.worst_s, 10.0) << line;
  }
}

TEST_F(SurveyLines, PointSourceSeparatesTheLinesOfAFile) {
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 2}}), Track()});
  const Errors errors = ExpectMapped(mapping, Soundings(), 0.99);
  EXPECT_LT(errors.worst_m, kTolerance_m);
  EXPECT_LT(errors.median_s, 1.0);
  EXPECT_LT(errors.worst_s, 10.0);
}

// As tiles or octrees are.
TEST_F(SurveyLines, TheOrderOfTheFileDoesNotCount) {
  std::vector<Point> points = Soundings();
  std::shuffle(points.begin(), points.end(), std::mt19937(1));
  const Mapping mapping =
      MappingOf({Las("a.las", {{"format", 1}}, All, Times::kAdjusted, points), Track()});
  const Errors errors = ExpectMapped(mapping, Soundings());
  EXPECT_LT(errors.worst_m, kTolerance_m);
  EXPECT_LT(errors.worst_s, 1e-3);
}

TEST_F(SurveyLines, ATrackWithoutAttitudeWillDo) {
  for (const bool heading : {true, false}) {
    const fs::path track = Track({.heading = heading, .attitude = false});
    const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}), track});
    EXPECT_THAT(mapping.text, HasSubstr(heading ? "attitude: heading" : "attitude: course"));
    EXPECT_LT(ExpectMapped(mapping, Soundings()).worst_m, kTolerance_m) << heading;
  }
}

// A line of text per second, give or take a tenth.
TEST_F(SurveyLines, ASlowTrackLosesNoSounding) {
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}), Track({.step_s = 1.0})});
  EXPECT_LT(ExpectMapped(mapping, Soundings()).worst_m, kTolerance_m);
}

// A ship: depths are below the water line at which it floats.
TEST_F(SurveyLines, ATrackWithoutDepthIsAtTheWaterLine) {
  const fs::path track = Track({.depth = false});
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}), track});
  EXPECT_LT(ExpectMapped(mapping, Soundings()).worst_m, kTolerance_m);
}

TEST_F(SurveyLines, TheTrackMayBeInAGridThatItsColumnsName) {
  const Mapping mapping = MappingOf({Las("a.las", {{"format", 1}}), Track({.grid = true})});
  EXPECT_LT(ExpectMapped(mapping, Soundings()).worst_m, kTolerance_m);
}

TEST_F(SurveyLines, XyzInDegreesOrInAGridWithDepthsOrHeights) {
  const fs::path track = Track();
  for (const bool degrees : {true, false})
    for (const double sign : {1.0, -1.0}) {
      std::ostringstream text;
      text.precision(12);
      for (const Point& point : OfLine(1)) {
        const Eigen::Vector2d p =
            degrees ? Geographic(point.p_ned_m.head<2>()) : Utm(point.p_ned_m.head<2>());
        text << p.x() << ' ' << p.y() << ' ' << sign * point.p_ned_m.z() << '\n';
      }
      const fs::path file = dir_.Write("b.xyz", text.str());
      const std::string notes = dir_.Write("b.xyz.yaml", "crs: EPSG:32632\n");
      if (degrees) fs::remove(notes);
      const Mapping mapping = MappingOf({file, track});
      EXPECT_THAT(mapping.text, HasSubstr(sign > 0 ? "z down" : "z up"));
      EXPECT_LT(ExpectMapped(mapping, OfLine(1), 0.99).worst_m, kTolerance_m) << degrees << sign;
    }
}

TEST_F(SurveyLines, XyzInAGridInFeetHasDepthsInTheUnitThatIsStatedElseInThatOfTheGrid) {
  constexpr double kUsFootM = 1200.0 / 3937.0;
  const fs::path track = Track();
  for (const auto& [stated, unit_m] :
       {std::pair{"", kUsFootM}, std::pair{"m", 1.0}, std::pair{"ft", 0.3048}}) {
    std::ostringstream text;
    text.precision(12);
    for (const Point& point : OfLine(1)) {
      const Eigen::Vector2d p = Utm(point.p_ned_m.head<2>()) / kUsFootM;
      text << p.x() << ' ' << p.y() << ' ' << point.p_ned_m.z() / unit_m << '\n';
    }
    const fs::path file = dir_.Write("b.xyz", text.str());
    const std::string z_unit = *stated == 0 ? "" : std::string("z_unit: ") + stated + "\n";
    dir_.Write("b.xyz.yaml", "crs: +proj=utm +zone=32 +datum=WGS84 +units=us-ft\n" + z_unit);
    EXPECT_LT(ExpectMapped(MappingOf({file, track}), OfLine(1), 0.99).worst_m, kTolerance_m)
        << stated;
    const SurveyPlan plan = MakeSurveyPlan({file, track});
    ASSERT_EQ(plan.warnings.size(), *stated == 0 ? 1u : 0u) << stated;
    if (*stated == 0) {
      EXPECT_EQ(plan.warnings[0].code, WarningCode::kUnitAssumed);
    }
  }
}

TEST_F(SurveyLines, TextWithAMapOfColumnsHasTimes) {
  std::ostringstream text;
  text.precision(15);
  text << "t;E;N;D\n";
  for (const Point& point : Soundings()) {
    const Eigen::Vector2d p = Utm(point.p_ned_m.head<2>());
    text << kNoon_s + point.t_s << ';' << p.x() << ';' << p.y() << ';' << -100.0 * point.p_ned_m.z()
         << '\n';
  }
  const fs::path file = dir_.Write("b.txt", text.str());
  dir_.Write("b.txt.yaml",
             "soundings: true\ndelimiter: semicolon\nheader_lines: 1\ncrs: EPSG:32632\ncolumns:\n"
             "  - {quantity: epoch, name: t}\n  - {quantity: east, name: E}\n"
             "  - {quantity: north, name: N}\n  - {quantity: depth, name: D, scale: -0.01}\n");
  const Mapping mapping = MappingOf({file, Track()});
  const Errors errors = ExpectMapped(mapping, Soundings());
  EXPECT_LT(errors.worst_m, kTolerance_m);
  EXPECT_LT(errors.worst_s, 1e-3);
}

TEST_F(SurveyLines, PiecesOfAnySizeGiveTheSamePings) {
  const auto is_first = [](const Point& point) { return point.t_s < 10.0; };
  const fs::path track = Track();
  for (const int format : {0, 1}) {
    const fs::path file = Las("a.las", {{"format", format}}, is_first);
    const SurveyPlan plan = MakeSurveyPlan({file, track});
    const ByteVector bytes = ReadBytes(file);
    const auto read = [&](std::size_t piece_bytes) {
      return TextOf(ReadSurvey(bytes, ReaderFor(file, plan.files[0].params).get(), piece_bytes));
    };
    const std::string whole = read(bytes.size());
    EXPECT_THAT(whole, HasSubstr("line_points_used"));
    EXPECT_TRUE(rc::check("any pieces give the same pings", [&] {
      RC_ASSERT(read(*rc::gen::inRange<std::size_t>(1, 100'000)) == whole);
    }));
  }
}

TEST_F(SurveyLines, PointsFarFromTheTrackAreCounted) {
  std::vector<Point> points = Soundings();
  for (std::size_t i = 0; i < 100; ++i) points[i].p_ned_m.x() -= 2000.0;
  for (std::size_t i = 100; i < 150; ++i) points[i].t_s = 4000.0;
  const Mapping mapping =
      MappingOf({Las("a.las", {{"format", 1}}, All, Times::kAdjusted, points), Track()});
  EXPECT_EQ(mapping.counters.at("line_points_far_from_track"), 100);
  EXPECT_EQ(mapping.counters.at("line_points_without_track"), 50);
  EXPECT_EQ(mapping.soundings.size(), points.size() - 150);
}

TEST_F(SurveyLines, FilesAndTrackAreOneDive) {
  const fs::path a = Las("a.las", {{"format", 1}});
  const fs::path b = Las("b.las", {{"format", 0}});
  const auto dives = DivesAmong({a, Track()});
  ASSERT_EQ(dives.size(), 1u);
  EXPECT_EQ(dives[0].name, "2026-05-02");
  EXPECT_EQ(dives[0].files.size(), 2u);
  EXPECT_EQ(DivesAmong({b, Track()})[0].name, "lines");
  const auto folder = DivesAmong({dir_.path()});
  EXPECT_EQ(folder[0].files.size(), 3u);
}

TEST_F(SurveyLines, ReplayMakesAMapOfTheFolder) {
  for (int line = 0; line < 3; ++line)
    Las("line" + std::to_string(line) + ".las", {{"format", 1}}, [line](const Point& point) {
      return point.line == line;
    });
  Track();
  fs::remove(dir_.path() / "in.json");
  TemporaryDir out;
  const auto result = RunCommand(Program("seastitch") + " replay --quiet " + dir_.path().string() +
                                 " --out " + (out.path() / "map").string());
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(fs::exists(out.path() / "map/elevation.tif"));
}

// Columns of navigation.csv.
// Depths of the first band, by place.
std::map<std::pair<double, double>, double> CellsOf(const fs::path& raster) {
  const auto text =
      RunCommand("gdal_translate -q -b 1 -of XYZ " + raster.string() + " /vsistdout/");
  EXPECT_EQ(text.exit_code, 0) << text.output;
  std::istringstream in(text.output);
  std::map<std::pair<double, double>, double> cells;
  for (double x = 0, y = 0, z = 0; in >> x >> y >> z;)
    if (z > -9000.0) cells[{x, y}] = z;
  return cells;
}

// A survey by sensors, exported; the export mapped. What is left is the millimetres of the export
// and the difference between two solutions of the graph.
TEST_F(SurveyLines, ExportedSoundingsAndNavigationGiveTheSameMapAgain) {
  const std::string log = (dir_.path() / "short.lcmlog").string();
  const std::string datum = " --datum 43.07,-70.71 --soundings ";
  ASSERT_EQ(RunCommand(Program("seastitch") + " bench --survey " + ConfigFile("bench/short.yaml") +
                       " --log " + log)
                .exit_code,
            0);
  ASSERT_EQ(Replay(log + datum + "las").exit_code, 0);
  const auto survey = CellsOf(dir_.path() / "map/elevation.tif");
  const fs::path exported = dir_.path() / "export";
  for (const char* const format : {"las", "xyz"}) {
    fs::remove_all(exported);
    fs::rename(dir_.path() / "map/export", exported);
    const auto again = Replay((exported / "soundings.").string() + format + " " +
                              (exported / "navigation.csv").string() + datum + "xyz");
    ASSERT_EQ(again.exit_code, 0) << again.output;
    double sum2 = 0.0;
    std::size_t both = 0;
    for (const auto& [place, depth] : CellsOf(dir_.path() / "map/elevation.tif"))
      if (const auto cell = survey.find(place); cell != survey.end())
        ++both, sum2 += std::pow(depth - cell->second, 2);
    EXPECT_GT(both, 0.99 * static_cast<double>(survey.size())) << format;
    EXPECT_LT(std::sqrt(sum2 / static_cast<double>(both)), 0.01) << format;
  }
}

TEST_F(SurveyLines, WhatCannotBePlacedEndsWithOneLine) {
  const fs::path track = Track();
  const fs::path las = Las("a.las", {{"format", 1}});
  ExpectRefused({las}, "no track of the vehicle beside it");
  ExpectRefused({Las("b.laz", {{"compression", 128}}), track}, "pdal translate b.laz b.las");
  ExpectRefused({Las("c.las", {{"none", 1}}), track}, "c.las.yaml, such as crs: EPSG:32632");
  ExpectRefused({Las("d.las", {{"epsg", 32633}}), track}, "none of its 13950 soundings");
  ExpectRefused({Las("e.las", {{"epsg", 1}}), track}, "e.las: coordinate reference system");
  std::vector<Point> points = Soundings();
  for (Point& point : points) point.p_ned_m.z() *= -1.0;
  ExpectRefused({Las("f.las", {{"format", 1}}, All, Times::kAdjusted, points), track},
                "f.las.yaml: z: down");
  ExpectRefused({Las("g.las", {{"format", 1}}, [](const Point&) { return false; }), track},
                "no sounding in it that can be used");
  ExpectRefused({las, Track({}, 86'400.0)}, "are not those of the track");
}

}  // namespace
}  // namespace seastitch
