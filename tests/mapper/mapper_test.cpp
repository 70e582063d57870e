#include "tests/mapper/mapper_fixtures.hpp"

namespace seastitch {
namespace {

// All sensors are silent for longer than navigation's history; meanwhile the vehicle does not move
// as dead reckoning extrapolates.
TEST(Mapper, TheEdgeAcrossALongGapHoldsTheTrueError) {
  Embedding dive;
  const double gap_s = MapperParams{}.navigation.window_s + 600.0;
  dive.Drive(60.0);
  const Time before = dive.vehicle.time;
  dive.vehicle.Sleep(gap_s);
  dive.Drive(60.0);
  dive.Finish();

  int across = 0;
  for (const GraphEdge& edge : dive.Edges(EdgeKind::kDeadReckoning)) {
    if (edge.from == edge.to) continue;
    const Submap& a = *dive.submaps.at(edge.from);
    const Submap& b = *dive.submaps.at(edge.to);
    const Pose2 truth = Inverse(LevelPose(dive.vehicle.TrueAt(a.frame_time))) *
                        LevelPose(dive.vehicle.TrueAt(b.frame_time));
    Eigen::Vector3d error = edge.T_from_to.Vector() - truth.Vector();
    error.z() = WrapAngle(error.z());
    EXPECT_LT(error.dot(edge.information * error), 16.3) << "99.9 % of 3 degrees of freedom";
    ASSERT_TRUE(b.covariance_from_previous.has_value());
    EXPECT_TRUE(b.heading_sigma_rad.has_value());
    if (!(a.end <= before && before < b.start)) continue;
    ++across;
    EXPECT_GT(error.head<2>().norm(), 1000.0) << "the guess was far off";
    EXPECT_GT((*b.covariance_from_previous)(0, 0), 1e6);
    EXPECT_LT((*b.covariance_from_previous)(0, 0), 1e9) << "unknown, but not without bounds";
  }
  EXPECT_EQ(across, 1);
}

// A cast of an hour ago, sent in the middle of a line. It reaches the mapper before or after the
// messages of other processes within navigation's reorder window.
TEST(Mapper, AProfileHoldsForTheSamePingsInWhicheverOrderItComes) {
  std::map<int, std::map<SubmapId, std::shared_ptr<const Submap>>> maps;
  constexpr int kNever = 5000;
  MapperParams params;
  params.submap.max_duration_s = 12.0;
  for (const int late_steps : {0, 1, 15, kNever}) {
    Embedding dive(params);
    std::int64_t seq = 0;
    Time said;
    for (int step = 0; step < 2000; ++step) {
      if (step == 1000) said = dive.vehicle.time;
      for (const auto& sample : dive.vehicle.Step(kSpeedMps, 0.0))
        std::visit([&](const auto& s) { dive.mapper.Add(s); }, sample);
      const auto say = [&](double age_s, double speed_mps, Time when) {
        const SoundVelocityProfile cast{
            when - FromSeconds(age_s), {0.0, 100.0}, {speed_mps, speed_mps}};
        dive.mapper.Add(cast, {when, seq++});
      };
      if (step == 0) say(7200.0, 1500.0, dive.vehicle.time);
      if (step == 1000 + late_steps) say(3600.0, 1450.0, said);
      dive.Pump();
    }
    dive.Finish();
    maps[late_steps] = dive.submaps;
  }
  ASSERT_GT(maps[0].size(), 1U);
  for (const int late_steps : {1, 15}) {
    ASSERT_EQ(maps[late_steps].size(), maps[0].size());
    for (const auto& [id, submap] : maps[0])
      EXPECT_TRUE(maps[late_steps].at(id)->cloud.points == submap->cloud.points)
          << "submap " << id.value << ", late by " << late_steps;
  }
  EXPECT_FALSE(maps[kNever].rbegin()->second->cloud.points ==
               maps[0].rbegin()->second->cloud.points);
}

// Only the sonar is silent for longer than navigation's history: the open submap closes after
// navigation has forgotten its frame.
TEST(Mapper, ASubmapThatClosesLateIsPlacedAsWellAsOneThatClosesAtOnce) {
  MapperParams params;
  params.navigation.window_s = 60.0;
  params.navigation.pose_window_s = 30.0;
  params.submap.max_duration_s = 30.0;
  Embedding dive(params);
  dive.Drive(70.0);
  dive.vehicle.sonar_on = false;
  dive.Drive(100.0);
  dive.vehicle.sonar_on = true;
  dive.Drive(40.0);
  dive.Finish();
  ASSERT_GE(dive.submaps.size(), 4u);
  int late = 0;
  for (const auto& [id, submap] : dive.submaps) {
    EXPECT_TRUE(submap->heading_sigma_rad.has_value()) << id.value;
    EXPECT_EQ(submap->covariance_from_previous.has_value(), id.value > 0) << id.value;
    if (submap->trigger != SubmapTrigger::kGap) continue;
    ++late;
    EXPECT_LT((*submap->covariance_from_previous)(0, 0), 1.0);
    EXPECT_GT((*submap->covariance_from_previous)(0, 0), 1e-6);
  }
  EXPECT_EQ(late, 1);
}

}  // namespace
}  // namespace seastitch
