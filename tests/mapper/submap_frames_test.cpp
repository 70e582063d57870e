#include "mapper/submap_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>

#include "common/core/pose.hpp"
#include "mapper/navigation/ins/given_navigation.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 1.5;
constexpr double kMetresPerRadian = 6335439.3;  // at the datum's latitude, 0

Time At(double t_s) { return FromUtime(1'700'000'000'000'000) + FromSeconds(t_s); }

// An INS that drives north, with a submap per minute.
struct Dive {
  void Drive(double until_s) {
    for (; t_s < until_s; t_s += 0.5) {
      NavigationSample sample;
      sample.time = At(t_s);
      sample.position = InsPosition{kSpeedMps * t_s / kMetresPerRadian, 0.0, {0.0, 0.0}};
      sample.depth = InsVertical{10.0, 0.0};
      sample.velocity = InsVelocity{{kSpeedMps, 0.0, 0.0}};
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
    PositionFix fix;
    fix.time = At(at_s);
    fix.latitude_rad = (kSpeedMps * at_s + 2.0) / kMetresPerRadian;
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    navigation.Add(fix);
  }

  double t_s = 0.0;
  GivenNavigation navigation{{}, {}, {}};
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

}  // namespace
}  // namespace seastitch
