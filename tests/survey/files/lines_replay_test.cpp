#include "tests/survey/files/lines_fixture.hpp"

namespace seastitch {
namespace {

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
