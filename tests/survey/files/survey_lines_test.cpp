// Soundings by line with a track beside them: files of a survey whose soundings are known, through
// plan, messages, navigation and geometry to the map. LAS is written by a script from the format's
// description, the grid by GeographicLib.

#include "tests/support/files.hpp"
#include "tests/survey/files/lines_fixture.hpp"

namespace seastitch {
namespace {

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
    const ByteVector bytes = BytesOf(file);
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

}  // namespace
}  // namespace seastitch
