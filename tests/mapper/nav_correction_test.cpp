// NAV_CORRECTED: the vehicle's pose in the solved map.

#include "mapper/nav_correction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "mapper/mapper.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 1.5;

MapperParams ShortSubmaps() {
  MapperParams params;
  params.submap.max_duration_s = 20.0;
  return params;
}

class Dive {
 public:
  explicit Dive(const MapperParams& params = ShortSubmaps()) : mapper_(params) {}
  void Drive(double duration_s, double yaw_rate_radps = 0.0) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle_.Step(kSpeedMps, yaw_rate_radps))
        std::visit([this](const auto& s) { mapper_.Add(s); }, sample);
      TakeEvents();
      while (auto job = mapper_.NextJob())
        mapper_.Take(seastitch::Run(
            *job, {}, [](SubmapId) { return nullptr; }, &prepared_));
      TakeEvents();
    }
  }
  void TakeEvents() {
    for (const MapperEvent& event : mapper_.TakeEvents()) {
      if (const auto* nav = std::get_if<NavState>(&event)) nav_ = *nav;
      if (const auto* step = std::get_if<GraphStep>(&event))
        for (const GraphVertex& vertex : step->update.vertices) vertices_.push_back(vertex);
      const auto* corrected = std::get_if<CorrectedNavState>(&event);
      if (corrected == nullptr) continue;
      // As a receiver gets it from the bus.
      said_ = FromLcm(ToLcm(*corrected, 0));
      ASSERT_TRUE(said_.has_value());
      EXPECT_EQ(said_->state.time, vehicle_.time) << "of the newest inertial sample";
    }
  }
  // A solution that moves every submap by the same, with a sigma of 0.1 m and 0.01 rad.
  PoseGraph Moved(const Pose2& by) const {
    PoseGraph solution;
    solution.graph_id = mapper_.graph().graph_id();
    solution.graph_version = mapper_.graph().version();
    for (const GraphVertex& vertex : vertices_) {
      SolvedVertex& solved = solution.vertices.emplace_back();
      solved.id = vertex.id;
      solved.T_map_level = by * vertex.dead_reckoned;
      solved.covariance = Eigen::Vector3d(1e-2, 1e-2, 1e-4).asDiagonal();
    }
    return solution;
  }
  // A fix at the vehicle with this error and a stated sigma of 1 m.
  PositionFix Fix(double north_off_m = 0.0, double east_off_m = 0.0) const {
    return vehicle_.Fix("gps", {north_off_m, east_off_m});
  }
  // With a fix every 10 s.
  void DriveWithFixes(double duration_s) {
    for (int i = 0; i < static_cast<int>(duration_s / 10.0); ++i) {
      Drive(10.0);
      mapper_.Add(Fix());
    }
    Drive(1.0);
  }
  Pose2 Off(const NavState& state) const {
    return Inverse(LevelPose(vehicle_.TrueAt(state.time))) * LevelPose(state.T_map_vehicle);
  }
  double Sigma(int axis) const { return std::sqrt(said_->state.covariance(axis, axis)); }

  PerfectVehicle vehicle_;
  PreparedSubmaps prepared_{{}};
  Mapper mapper_;
  std::optional<NavState> nav_;
  std::optional<CorrectedNavState> said_;
  std::vector<GraphVertex> vertices_;
};

class CorrectedDive : public testing::Test, protected Dive {};

TEST_F(CorrectedDive, IsOfNowAlsoInATurn) {
  Drive(30.0);
  Drive(10.0, 0.3);
  const auto off = [this](const NavState& state) {
    return Inverse(LevelPose(vehicle_.TrueAt(state.time))) * LevelPose(state.T_map_vehicle);
  };
  const Pose2 nav = off(*nav_), said = off(said_->state);
  // Meanwhile the vehicle has turned by 9 degrees and moved 0.75 m.
  EXPECT_NEAR(said.x, nav.x, 0.02);
  EXPECT_NEAR(said.y, nav.y, 0.02);
  EXPECT_NEAR(said.yaw, nav.yaw, Deg2Rad(0.1)) << "NAV itself is off by " << Rad2Deg(nav.yaw);
  EXPECT_GT(ToSeconds(said_->state.time - nav_->time), 0.4) << "NAV is half a second behind";
  EXPECT_EQ(said_->graph_version, 0);
  EXPECT_EQ(said_->jumps, 0);
  EXPECT_EQ(said_->T_map_nav.Vector().norm(), 0.0);
}

TEST_F(CorrectedDive, ASolutionMovesItAndCountsAsAJumpAndNavStays) {
  Drive(70.0);
  ASSERT_GE(vertices_.size(), 2u);
  const Pose2 by{30.0, -20.0, 0.1};
  ASSERT_TRUE(mapper_.Take(Moved(by)));
  const Eigen::Vector3d nav_before = nav_->T_map_vehicle.translation();
  Drive(0.2);
  EXPECT_LT((nav_->T_map_vehicle.translation() - nav_before).norm(), 1.0);
  EXPECT_EQ(said_->jumps, 1);
  EXPECT_EQ(said_->graph_version, mapper_.graph().version());
  EXPECT_LT((said_->T_map_nav.Vector() - by.Vector()).norm(), 1e-6);
  const Pose2 truth = by * LevelPose(vehicle_.TrueAt(vehicle_.time));
  const Pose2 said = LevelPose(said_->state.T_map_vehicle);
  EXPECT_LT((said.Translation() - truth.Translation()).norm(), 0.2);
  EXPECT_NEAR(WrapAngle(said.yaw - truth.yaw), 0.0, Deg2Rad(0.5));
  // A rotation of 0.1 rad about the map's origin, about 100 m away, besides the shift.
  EXPECT_NEAR(said_->last_jump_m, 31.0, 6.0);
  EXPECT_NEAR(said_->last_jump_yaw_rad, 0.1, 1e-6);
  EXPECT_NEAR(std::atan2(said_->state.v_map_mps.y(), said_->state.v_map_mps.x()), 0.1, 0.02);
}

TEST_F(CorrectedDive, GoesOnWithGrowingSigmaWhenTheOptimizerIsSilent) {
  Drive(70.0);
  ASSERT_TRUE(mapper_.Take(Moved({})));
  Drive(1.0);
  const double north_m = Sigma(0), yaw_rad = Sigma(5);
  EXPECT_LT(north_m, 0.5);
  Drive(120.0);
  EXPECT_GT(Sigma(0), north_m);
  EXPECT_GE(Sigma(5), yaw_rad);
  EXPECT_GT(Sigma(1), 120.0 * kSpeedMps * 0.009) << "the heading's sigma, 200 m on";
  EXPECT_EQ(said_->jumps, 1);
}

// As before a dive: GPS is available, and no submap exists.
TEST_F(CorrectedDive, FixesMoveItWithoutAnySubmap) {
  vehicle_.sonar_on = false;
  vehicle_.compass_step_rad = 0.02;
  DriveWithFixes(200.0);
  EXPECT_TRUE(vertices_.empty());
  const Pose2 nav = Off(*nav_), said = Off(said_->state);
  EXPECT_GT(nav.Translation().norm(), 5.0);
  EXPECT_LT(said.Translation().norm(), 0.5);
  EXPECT_LT(std::abs(said.yaw), Deg2Rad(0.4)) << "NAV is off by " << Rad2Deg(nav.yaw);
  EXPECT_LT(Sigma(0), 0.8);
  EXPECT_LT(Sigma(1), 0.8);
  EXPECT_LT(Sigma(5), Deg2Rad(0.8));
  EXPECT_GE(said_->jumps, 18);
  EXPECT_LT(said_->last_jump_m, 0.5);
}

// As after a dive: no submap closes any more.
TEST_F(CorrectedDive, FixesAfterTheLastSubmapMoveIt) {
  Drive(70.0);
  ASSERT_TRUE(mapper_.Take(Moved({30.0, -20.0, 0.0})));  // a certain solution
  vehicle_.sonar_on = false;
  Drive(30.0);
  EXPECT_GT(Off(said_->state).Translation().norm(), 30.0);
  DriveWithFixes(20.0);
  EXPECT_GT(Off(said_->state).Translation().norm(), 30.0) << "two fixes may be wrong";
  DriveWithFixes(40.0);
  EXPECT_LT(Off(said_->state).Translation().norm(), 1.0);
  EXPECT_LT(Sigma(0), 1.5);
}

TEST_F(CorrectedDive, AWildFixMovesItLittleAndMakesItNoSurer) {
  vehicle_.sonar_on = false;
  DriveWithFixes(60.0);
  Drive(9.0);
  const double sigma_m = Sigma(0);
  mapper_.Add(Fix(500.0, -300.0));
  Drive(1.0);
  EXPECT_LT(Off(said_->state).Translation().norm(), 0.5);
  EXPECT_GT(Sigma(0), 0.95 * sigma_m);
}

TEST_F(CorrectedDive, AFixThatComesLateCountsAsIfItHadComeInTime) {
  Dive in_time, late;
  for (Dive* dive : {&in_time, &late}) {
    dive->vehicle_.sonar_on = false;
    dive->vehicle_.compass_step_rad = 0.02;
    dive->DriveWithFixes(40.0);
    dive->Drive(9.0);
    PositionFix acoustic = dive->Fix(3.0, 2.0);
    acoustic.source = "usbl";
    if (dive == &in_time) dive->mapper_.Add(acoustic);
    dive->Drive(5.0);
    dive->mapper_.Add(dive->Fix(-1.0, 0.5));
    dive->Drive(5.0);
    if (dive == &late) dive->mapper_.Add(acoustic);
    dive->Drive(1.0);
  }
  EXPECT_GT(in_time.said_->T_map_nav.Vector().norm(), 0.1);
  EXPECT_LT((in_time.said_->T_map_nav.Vector() - late.said_->T_map_nav.Vector()).norm(), 1e-9);
  EXPECT_LT((in_time.said_->state.covariance - late.said_->state.covariance).norm(), 1e-9);
}

// A fix that is part of the solution has no further effect.
TEST_F(CorrectedDive, AFixThatASolutionHasCountsOnce) {
  Drive(30.0);
  mapper_.Add(Fix(4.0, 0.0));
  Drive(50.0);  // two more submaps; one of them has the fix
  ASSERT_GE(vertices_.size(), 3u);
  EXPECT_GT(said_->T_map_nav.x, 0.0);
  const Pose2 by{2.0, 1.0, 0.0};
  ASSERT_TRUE(mapper_.Take(Moved(by)));
  Drive(0.2);
  EXPECT_LT((said_->T_map_nav.Vector() - by.Vector()).norm(), 1e-6);
}

// The solution is from before the fix.
TEST_F(CorrectedDive, AFixThatASolutionLacksStillCounts) {
  Drive(70.0);
  const PoseGraph solution = Moved({});
  mapper_.Add(Fix(4.0, 0.0));
  Drive(1.0);
  const double by_fix_m = said_->T_map_nav.x;
  EXPECT_GT(by_fix_m, 0.01);
  ASSERT_TRUE(mapper_.Take(solution));
  Drive(0.2);
  EXPECT_GT(said_->T_map_nav.x, 0.001);
}

// The fix shows that the whole way so far was off; the submap's position is known better from the
// solution.
TEST(NavCorrection, WhatNavLearnsOfTheWayBeforeTheSubmapDoesNotMoveIt) {
  MapperParams params = ShortSubmaps();
  params.navigation.start_sigma_m = 30.0;
  params.navigation.fuse_position_fixes = true;
  Dive dive(params);
  dive.Drive(70.0);
  ASSERT_TRUE(dive.mapper_.Take(dive.Moved({})));
  dive.Drive(0.2);
  const Eigen::Vector2d nav_off = dive.Off(*dive.nav_).Translation();
  const Eigen::Vector2d said_off = dive.Off(dive.said_->state).Translation();
  dive.mapper_.Add(dive.Fix(10.0, 0.0));
  dive.Drive(1.0);
  EXPECT_NEAR((dive.Off(*dive.nav_).Translation() - nav_off).norm(), 10.0, 0.5);
  EXPECT_LT((dive.Off(dive.said_->state).Translation() - said_off).norm(), 0.2);
}

TEST_F(CorrectedDive, ASolutionThatIsNotUsedMovesNothing) {
  Drive(70.0);
  PoseGraph foreign = Moved({30.0, 0.0, 0.0});
  ++foreign.graph_id;
  ASSERT_FALSE(mapper_.Take(foreign));
  Drive(1.0);
  EXPECT_EQ(said_->jumps, 0);
  EXPECT_EQ(said_->T_map_nav.Vector().norm(), 0.0);
}

}  // namespace
}  // namespace seastitch
