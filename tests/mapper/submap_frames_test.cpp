#include "mapper/submap_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>

#include "common/core/pose.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 1.5;

Time At(double t_s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(t_s); }

// An INS that drives north, with a submap per minute.
struct Dive {
  void Drive(double until_s) {
    for (; t_s < until_s; t_s += 0.5) {
      NavigationSample sample;
      sample.time = At(t_s);
      sample.position = GeoPosition{PointAt(kSpeedMps * t_s)};
      sample.depth = InsVertical{10.0, 0.0};
      sample.velocity = GeoVelocity{{kSpeedMps, 0.0, 0.0}};
      sample.attitude = Attitude{Eigen::Quaterniond::Identity()};
      navigation.Add(sample);
    }
  }
  // The edges that come with the submap of the last minute.
  std::vector<GraphEdge> Close(int id) {
    Drive(60.0 * (id + 1) + 10.0);
    Submap submap;
    submap.id = SubmapId{id};
    submap.frame_time = At(60.0 * id + 30.0);
    return frames.Place(&submap, id == 0, navigation.TakeFixes(*navigation.latest()));
  }
  void AddFix(double at_s) {
    navigation.Add(
        PositionFix{PointAt(kSpeedMps * at_s + 2.0), At(at_s), Eigen::Matrix2d::Identity(), {}});
  }

  double t_s = 0.0;
  InsNavigation navigation{{}, {}, {}};
  SubmapFrames frames{&navigation};
};

// On the submap that closes, the fix would have half an hour of dead reckoning between, and inform
// almost nothing.
TEST(SubmapFrames, AFixHalfAnHourLateIsAttachedToTheSubmapInWhichItWasTaken) {
  Dive dive;
  for (int id = 0; id < 34; ++id) dive.Close(id);
  dive.AddFix(3.0 * 60.0 + 35.0);
  const std::vector<GraphEdge> edges = dive.Close(34);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].kind, EdgeKind::kPositionFix);
  EXPECT_EQ(edges[0].to, SubmapId{3});
  EXPECT_NEAR(edges[0].T_from_to.x, kSpeedMps * 210.0 + 2.0, 0.05);
  EXPECT_GT(edges[0].information(0, 0), 0.9) << "its own sigma of 1 m, and 5 s of navigation";
}

// Navigation has forgotten the nearest frame, and knows the fix.
TEST(SubmapFrames, AFixIsAttachedToTheNearestFrameThatNavigationKnows) {
  Dive dive;
  for (int id = 0; id < 60; ++id) dive.Close(id);
  dive.Drive(3710.0);
  const double oldest_s = dive.t_s - NavigationParams().window_s;  // 1310
  dive.AddFix(oldest_s + 2.0);                                     // the frames: at 1290, 1350
  const std::vector<GraphEdge> edges = dive.Close(60);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].to, SubmapId{22});
  EXPECT_EQ(dive.frames.fixes_too_far(), 0);
}

std::vector<double> SecondsOf(const std::vector<Submap>& frames) {
  std::vector<double> seconds;
  for (const Submap& frame : frames) seconds.push_back(ToSeconds(frame.frame_time - At(0.0)));
  return seconds;
}

// At the surface before and after the survey.
TEST(SubmapFrames, FixesFarFromAnySubmapGetFramesOfTheirOwn) {
  Dive dive;
  dive.Drive(110.0);
  for (double t_s = 5.0; t_s < 100.0; t_s += 10.0) dive.AddFix(t_s);
  const std::vector<MapFix> early = dive.navigation.TakeFixes(At(110.0));
  const std::vector<Submap> frames = dive.frames.FramesFor(early, At(115.0));
  EXPECT_EQ(SecondsOf(frames), (std::vector{5.0, 35.0, 65.0}));
  for (const Submap& frame : frames) {
    EXPECT_FALSE(HasSoundings(frame.trigger));
    EXPECT_NEAR(frame.T_map_submap.translation().x(),
                kSpeedMps * ToSeconds(frame.frame_time - At(0.0)),
                0.05);
  }
  dive.Close(1);  // its frame: at 90 s
  dive.Drive(200.0);
  for (const double t_s : {105.0, 115.0, 125.0, 150.0}) dive.AddFix(t_s);
  EXPECT_EQ(SecondsOf(dive.frames.FramesFor(dive.navigation.WaitingFixes(), std::nullopt)),
            (std::vector{115.0, 150.0}));
}

// Each fix is attached to the frame that it gave.
TEST(SubmapFrames, AFrameForFixesTakesThePositionOfTheStartAndTheFixesNearIt) {
  Dive dive;
  dive.Drive(100.0);
  for (const double t_s : {5.0, 15.0}) dive.AddFix(t_s);
  const std::vector<MapFix> fixes = dive.navigation.TakeFixes(At(100.0));
  std::vector<Submap> frames = dive.frames.FramesFor(fixes, At(100.0));
  ASSERT_EQ(frames.size(), 1u);
  frames[0].id = SubmapId{0};
  EXPECT_EQ(dive.frames.Place(&frames[0], true, {}).size(), 1u);
  Submap submap;
  submap.id = SubmapId{1};
  submap.frame_time = At(110.0);
  dive.Drive(120.0);
  const std::vector<GraphEdge> edges = dive.frames.Place(&submap, false, fixes);
  ASSERT_EQ(edges.size(), 2u);
  for (const GraphEdge& edge : edges) EXPECT_EQ(edge.to, SubmapId{0});
  EXPECT_TRUE(submap.covariance_from_previous);
}

}  // namespace
}  // namespace seastitch
