#include "page/live_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace seastitch {
namespace {

using nlohmann::json;

std::string FromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 0xff);
  }
  return bytes;
}

// The value of a raster at a place, as viewer.js reads it; NaN: none.
double ValueAt(const json& map, const std::string& name, double north, double east) {
  for (const json& raster : map["rasters"]) {
    if (raster["name"] != name) continue;
    const std::string packed = FromBase64(raster["data"]);
    const std::size_t rows = map["rows"], cols = map["cols"];
    std::string planes(2 * rows * cols, '\0');
    uLongf size = planes.size();
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(planes.data()),
                         &size,
                         reinterpret_cast<const Bytef*>(packed.data()),
                         packed.size()),
              Z_OK);
    const double cell_m = map["cell_m"];
    const auto row = static_cast<std::size_t>((north - double(map["north_m"])) / cell_m);
    const auto col = static_cast<std::size_t>((east - double(map["east_m"])) / cell_m);
    std::uint16_t code = 0;
    for (std::size_t c = 0; c <= col; ++c) {
      const std::size_t i = row * cols + c;
      code = static_cast<std::uint16_t>(code + static_cast<std::uint8_t>(planes[i]) +
                                        256 * static_cast<std::uint8_t>(planes[rows * cols + i]));
    }
    if (code == 0) return std::numeric_limits<double>::quiet_NaN();
    return double(raster["lowest"]) + (code - 1) * double(raster["step"]);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// A square of 20 m around its frame, seen from depth 5 m: the seabed is at `depth_m`.
Submap Square(int id, double north, double east, double depth_m, double yaw = 0.0) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.frame_time = FromUtime(1'000'000LL * (100 + 10 * id));
  submap.T_map_submap = MakePose({north, east, 5.0}, RotationFromRpy(0.0, 0.0, yaw));
  for (float x = -10.0f; x <= 10.0f; x += 0.4f)
    for (float y = -10.0f; y <= 10.0f; y += 0.4f)
      submap.cloud.Add({x, y, static_cast<float>(depth_m - 5.0)});
  submap.footprint = {{-10, -10}, {10, -10}, {10, 10}, {-10, 10}};
  return submap;
}

PoseGraph Solution(std::vector<std::pair<int, Pose2>> poses, std::int64_t graph_id = 1) {
  PoseGraph graph;
  graph.graph_id = graph_id;
  for (const auto& [id, pose] : poses) graph.vertices.push_back({SubmapId{id}, pose});
  return graph;
}

TEST(LiveMap, WithoutASubmapThereIsNoMap) { EXPECT_FALSE(LiveMap().Json()); }

TEST(LiveMap, AClosedSubmapIsShownWhereDeadReckoningHasIt) {
  LiveMap map;
  map.Add(Square(0, 100.0, 50.0, 23.0, 0.5));
  const json shown = json::parse(map.Json().value());
  EXPECT_NEAR(ValueAt(shown, "elevation", 100.0, 50.0), -23.0, 0.01);
  EXPECT_NEAR(ValueAt(shown, "elevation", 108.0, 50.0), -23.0, 0.01);
  EXPECT_TRUE(std::isnan(ValueAt(shown, "elevation", 112.5, 62.5))) << "a corner, turned away";
  EXPECT_EQ(shown["submaps"][0]["id"], 0);
  EXPECT_EQ(shown["rasters"].size(), 1u) << "nothing to compare with";
}

TEST(LiveMap, ASolutionMovesSubmapsTrackAndClosures) {
  LiveMap map;
  map.Add(Square(0, 0.0, 0.0, 20.0));
  map.Add(Square(1, 40.0, 0.0, 30.0));
  map.AddTrack(FromUtime(100'000'000), {0.0, 0.0});
  map.AddTrack(FromUtime(105'000'000), {20.0, 0.0});
  map.AddTrack(FromUtime(110'000'000), {40.0, 0.0});
  PoseGraph solution = Solution({{0, {0.0, 0.0, 0.0}}, {1, {40.0, 8.0, 0.0}}});
  solution.loop_edges = {{SubmapId{0}, SubmapId{1}, 0.9}, {SubmapId{1}, SubmapId{0}, 0.1}};
  map.Add(solution);
  EXPECT_EQ(map.closures(true), 1u);
  EXPECT_EQ(map.closures(false), 1u);
  const json shown = json::parse(map.Json().value());
  EXPECT_NEAR(ValueAt(shown, "elevation", 40.0, 15.0), -30.0, 0.01);
  EXPECT_NEAR(ValueAt(shown, "elevation_before", 40.0, -8.0), -30.0, 0.01);
  EXPECT_TRUE(std::isnan(ValueAt(shown, "elevation", 40.0, -8.0)));
  EXPECT_EQ(shown["track_before"][0], json({0.0, 0.0, 20.0, 0.0, 40.0, 0.0}));
  EXPECT_EQ(shown["track"][0], json({0.0, 0.0, 20.0, 4.0, 40.0, 8.0})) << "between both frames";
  EXPECT_EQ(shown["closures"][0]["line"], json({0.0, 0.0, 40.0, 8.0}));
  EXPECT_EQ(shown["closures"][0]["used"], true);
  EXPECT_EQ(shown["closures"][1]["used"], false);
}

TEST(LiveMap, ASubmapThatIsNotSolvedYetFollowsTheOneBefore) {
  LiveMap map;
  map.Add(Square(0, 0.0, 0.0, 20.0));
  map.Add(Solution({{0, {0.0, 30.0, 0.0}}}));
  map.Add(Square(1, 40.0, 0.0, 25.0));
  const json shown = json::parse(map.Json().value());
  EXPECT_NEAR(ValueAt(shown, "elevation", 40.0, 30.0), -25.0, 0.01);
}

TEST(LiveMap, TheSubmapsOfAnotherMapBeginItAnew) {
  LiveMap map;
  for (const int id : {0, 1, 2}) map.Add(Square(id, 30.0 * id, 0.0, 20.0));
  EXPECT_FALSE(map.Add(Square(1, 30.0, 0.0, 20.0)));
  EXPECT_EQ(map.submaps(), 3u) << "the same once more";
  Submap other = Square(1, 30.0, 0.0, 20.0);
  other.frame_time = FromUtime(999);
  EXPECT_TRUE(map.Add(other));
  EXPECT_EQ(map.submaps(), 1u);
}

// Of another mapper on the bus: the next solution of its own brings the map back.
TEST(LiveMap, TheSolutionOfAForeignGraphTakesNoSubmapAway) {
  LiveMap map;
  for (const int id : {0, 1}) map.Add(Square(id, 30.0 * id, 0.0, 20.0));
  const PoseGraph own = Solution({{0, {0.0, 5.0, 0.0}}, {1, {30.0, 5.0, 0.0}}}, 7);
  map.Add(own);
  const std::string before = map.Json().value();
  map.Add(Solution({{0, {900.0, 0.0, 0.0}}}, 8));
  EXPECT_EQ(map.submaps(), 2u);
  map.Add(own);
  EXPECT_EQ(map.Json().value(), before);
}

// One submap of a few points over a large area, among others.
TEST(LiveMap, OneOddSubmapMakesNoCellsCoarse) {
  LiveMap map;
  for (int id = 0; id < 3; ++id) map.Add(Square(id, 25.0 * id, 0.0, 20.0));
  Submap odd = Square(3, 75.0, 0.0, 20.0);
  odd.footprint = {{-9000, -9000}, {9000, -9000}, {9000, 9000}, {-9000, 9000}};
  map.Add(odd);
  EXPECT_LT(double(json::parse(map.Json().value())["cell_m"]), 1.0);
}

TEST(LiveMap, ItsMemoryIsBounded) {
  LiveMap map(0.5, 20'000);
  for (int id = 0; id < 100; ++id) {
    map.Add(Square(id, 25.0 * id, 0.0, 20.0 + id % 5));
    map.AddTrack(FromUtime(id), {25.0 * id, 0.0});
  }
  EXPECT_LE(map.cells(), 20'000u);
  EXPECT_EQ(map.submaps(), 100u);
  for (int i = 0; i < 100'000; ++i) map.AddTrack(FromUtime(i), {0.1 * i, 0.0});
  const json shown = json::parse(map.Json().value());
  EXPECT_NEAR(ValueAt(shown, "elevation", 25.0 * 52, 0.0), -22.0, 0.01);
  EXPECT_LE(shown["track"][0].size(), 2 * LiveMap::kMostTrackPoints);
  EXPECT_LE(std::size_t(shown["rows"]) * std::size_t(shown["cols"]), 500'000u);
}

// Points a few metres apart, as a sonar has them in deep water.
TEST(LiveMap, SparsePointsLeaveNoHoles) {
  LiveMap map;
  Submap submap = Square(0, 0.0, 0.0, 20.0);
  submap.cloud = {};
  for (float x = -100.0f; x <= 100.0f; x += 5.0f)
    for (float y = -100.0f; y <= 100.0f; y += 5.0f) submap.cloud.Add({x, y, 95.0f});
  submap.footprint = {{-100, -100}, {100, -100}, {100, 100}, {-100, 100}};
  map.Add(submap);
  const json shown = json::parse(map.Json().value());
  for (double north = -80.0; north < 80.0; north += 7.0)
    EXPECT_NEAR(ValueAt(shown, "elevation", north, 33.0), -100.0, 0.01) << north;
}

// What a message may hold, and a map cannot show.
TEST(LiveMap, PosesThatAreFarAwayAreLeftOut) {
  LiveMap map;
  map.Add(Square(0, 0.0, 0.0, 20.0));
  map.Add(Square(1, 1e12, 0.0, 20.0));
  const json shown = json::parse(map.Json().value());
  EXPECT_LT(double(shown["cell_m"]), 1.0);
  map.Add(Solution({{0, {1e12, 0.0, 0.0}}}));
  EXPECT_FALSE(map.Json());
}

}  // namespace
}  // namespace seastitch
