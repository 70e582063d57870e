#include "tests/mapper/submaps/builder_fixtures.hpp"

namespace seastitch {
namespace {

TEST(SubmapBuilder, ClosesAtTheMaximumLengthOverAFlatSeabed) {
  Drive drive;
  drive.Straight(230.0);
  ASSERT_EQ(drive.closed.size(), 2u);
  for (const Submap& submap : drive.closed) EXPECT_EQ(submap.trigger, SubmapTrigger::kLength);
  const double length_m =
      (drive.closed[1].T_map_submap.translation() - drive.closed[0].T_map_submap.translation())
          .norm();
  EXPECT_NEAR(length_m, 100.0, 1.0);
}

TEST(SubmapBuilder, ClosesWhereDeadReckoningHasLostTooMuchButNotBeforeTheMinimum) {
  for (const auto& [drift_mps, expected_m] : {std::pair{0.0125, 60.0}, std::pair{1.0, 30.0}}) {
    SubmapParams params;
    params.max_drift_m = 0.5;
    Drive drive(params, {}, [drift_mps = drift_mps](Time from, Time to) -> Eigen::Matrix3d {
      const double lost_m = drift_mps * ToSeconds(to - from);
      return Eigen::Vector3d(0.0, lost_m * lost_m, 0.0).asDiagonal();
    });
    drive.Straight(150.0);
    ASSERT_GE(drive.closed.size(), 2u);
    for (const Submap& submap : drive.closed) {
      EXPECT_EQ(submap.trigger, SubmapTrigger::kLength);
      EXPECT_NEAR(kSpeedMps * ToSeconds(submap.end - submap.start), expected_m, 5.5);
    }
  }
}

TEST(SubmapBuilder, ClosesEarlierWhereTheSeabedHasStructureButNotBeforeTheMinimum) {
  Drive drive;
  drive.swath.seabed = BumpySeabed;
  drive.Straight(120.0);
  ASSERT_GE(drive.closed.size(), 2u);
  for (const Submap& submap : drive.closed) {
    EXPECT_EQ(submap.trigger, SubmapTrigger::kInformation);
    const double length_m = kSpeedMps * ToSeconds(submap.end - submap.start);
    EXPECT_GE(length_m, 29.0);
    EXPECT_LE(length_m, 60.0);
    EXPECT_GT(submap.predicted_information.value()(0, 0), 100.0);  // better than 0.1 m
  }
}

// No registration is better than a drift of a millimetre.
TEST(SubmapBuilder, ClosesForItsStructureOnlyWhereThisBeatsDeadReckoningInEveryDirection) {
  const double yaw = Deg2Rad(0.5);
  for (const auto& [drift, trigger] : {std::pair{Loses(0.5, 0.5, yaw), SubmapTrigger::kInformation},
                                       std::pair{Loses(0.001, 0.5, yaw), SubmapTrigger::kLength},
                                       std::pair{Loses(0.5, 0.001, yaw), SubmapTrigger::kLength},
                                       std::pair{Loses(0.5, 0.5, 0.0), SubmapTrigger::kLength},
                                       std::pair{Loses(0.0, 0.0, 0.0), SubmapTrigger::kLength}}) {
    Drive drive({}, {}, drift);
    drive.swath.seabed = BumpySeabed;
    drive.Straight(120.0);
    ASSERT_GE(drive.closed.size(), 1u);
    EXPECT_EQ(drive.closed[0].trigger, trigger);
  }
}

// Three lines of 90 m side by side. A registration is compared with the drift since the vehicle
// passed here on the line before: small just after a turn, large at the other end.
struct Turning {
  const char* name;
  bool sonar_on;   // during turns
  int min_points;  // of a submap
};
class EarlierLine : public testing::TestWithParam<Turning> {};

TEST_P(EarlierLine, HasToBeatWhatWasLostSinceItsNearestSubmap) {
  struct Asked {
    Time a, b;
  };
  std::vector<Asked> asked;
  SubmapParams params;
  params.min_points = GetParam().min_points;
  Drive drive(params, {}, [&](Time a, Time b) -> Eigen::Matrix3d {
    asked.push_back({a, b});
    return Eigen::Vector3d(0.01, 0.01, 1e-5).asDiagonal();
  });
  drive.swath.seabed = BumpySeabed;
  std::map<Time, std::pair<int, Eigen::Vector2d>> track;  // line, place
  for (int line = 0; line < 3; ++line) {
    for (int i = 0; i < 360; ++i) {
      drive.Step(0.0);
      track[drive.time] = {line, {drive.x, drive.y}};
    }
    drive.sonar_on = GetParam().sonar_on;
    // a turn with a radius of 12.7 m
    for (int i = 0; i < 160; ++i) drive.Step((line == 0 ? kPi : -kPi) / 160.0);
    drive.sonar_on = true;
  }
  std::vector<int> on_line_before(3, 0);
  for (const Asked& q : asked) {
    const auto here = track.find(q.a);
    const auto there = track.find(q.b);
    if (here == track.end() || there == track.end()) continue;  // during a turn
    const auto& [line, place] = here->second;
    const auto& [earlier, neighbour] = there->second;
    if (line == earlier) continue;  // drift inside a submap
    ASSERT_EQ(earlier, line - 1);
    ++on_line_before[static_cast<std::size_t>(line)];
    // Across: at most twice the radius. Along: at most to the middle of the next submap.
    EXPECT_LT((place - neighbour).norm(), 45.0);
    EXPECT_NEAR(std::abs(place.y() - neighbour.y()), 25.5, 2.0);
  }
  EXPECT_GE(on_line_before[1], 3);  // at least once per submap
  EXPECT_GE(on_line_before[2], 3);
  EXPECT_EQ(drive.builder.counters().count("submaps_too_small") > 0, params.min_points > 50);
}

INSTANTIATE_TEST_SUITE_P(SubmapBuilder,
                         EarlierLine,
                         testing::Values(Turning{"SonarOnInTurns", true, 50},
                                         Turning{"SonarOffInTurns", false, 50},
                                         Turning{"LastPieceTooSmallSonarOn", true, 4000},
                                         Turning{"LastPieceTooSmallSonarOff", false, 4000}),
                         [](const auto& test) { return test.param.name; });

TEST(SubmapBuilder, PredictsNothingOverAFlatSeabedAndARidgeOnlyAcross) {
  Drive flat;
  flat.Straight(60.0);
  flat.Finish();
  ASSERT_EQ(flat.closed.size(), 1u);
  EXPECT_EQ(flat.closed[0].trigger, SubmapTrigger::kEnd);
  EXPECT_LT(flat.closed[0].predicted_information.value().topLeftCorner(2, 2).trace(), 25.0);

  Drive ridges;
  ridges.swath.seabed = [](double x, double) { return 20.0 + 0.8 * std::sin(0.4 * x); };
  ridges.Straight(60.0);
  ridges.Finish();
  ASSERT_EQ(ridges.closed.size(), 1u);
  const Eigen::Matrix3d information = ridges.closed[0].predicted_information.value();
  EXPECT_GT(information(0, 0), 1000.0);
  EXPECT_LT(information(1, 1), 0.01 * information(0, 0));
}

TEST(SubmapBuilder, GivesATurnItsOwnSubmaps) {
  Drive drive;
  drive.Straight(60.0);
  drive.Turn(kPi, 15.0);
  drive.Straight(60.0);
  drive.Finish();
  ASSERT_EQ(drive.closed.size(), 3u);
  EXPECT_EQ(drive.closed[0].trigger, SubmapTrigger::kTurn);
  EXPECT_EQ(drive.closed[1].trigger, SubmapTrigger::kTurn);
  EXPECT_EQ(drive.closed[2].trigger, SubmapTrigger::kEnd);
  EXPECT_NEAR(LevelPose(drive.closed[0].T_map_submap).yaw, 0.0, 0.01);
  EXPECT_NEAR(std::abs(LevelPose(drive.closed[2].T_map_submap).yaw), kPi, 0.01);
  EXPECT_LT(drive.closed[0].heading_spread, 0.2);
  // For headings spread evenly over half a circle.
  EXPECT_NEAR(drive.closed[1].heading_spread, std::sqrt(2.0 - 4.0 / kPi), 0.15);
  EXPECT_LT(drive.closed[2].heading_spread, 0.2);
}

TEST(SubmapBuilder, StatesTheDriftOfTheTimeWithoutBottomLock) {
  SubmapParams params;
  params.max_drift_m = 1e6;
  Drive drive(params, {}, Loses(0.1, 0.3, 0.0));
  drive.Straight(130.0);
  drive.bottom_lock = false;
  drive.Straight(20.0);
  drive.bottom_lock = true;
  drive.Straight(45.0);
  drive.Finish();
  ASSERT_EQ(drive.closed.size(), 2u);
  EXPECT_EQ(drive.closed[0].drift_per_m, 0.0);
  const double length_m =
      kSpeedMps * ToSeconds(drive.closed[1].end - drive.closed[1].start) + kStepM;
  EXPECT_NEAR(drive.closed[1].drift_per_m, 0.3 / length_m, 0.02 * 0.3 / length_m);
}

TEST(SubmapBuilder, LeavesTurnsOutWhereSoConfigured) {
  SubmapParams params;
  params.keep_turns = false;
  Drive drive(params);
  drive.Straight(60.0);
  drive.Turn(kPi, 15.0);
  drive.Straight(60.0);
  drive.Finish();
  ASSERT_EQ(drive.closed.size(), 2u);
  EXPECT_GT(drive.builder.counters().at("pings_in_turns"), 100);
}

TEST(SubmapBuilder, IsNotTurnedByYawing) {
  Drive drive;
  // +-46 degrees, for 2 m each
  for (int i = 0; i < 320; ++i) drive.Step((i / 4) % 2 == 0 ? 0.2 : -0.2);
  drive.Finish();
  ASSERT_EQ(drive.closed.size(), 1u);
  EXPECT_EQ(drive.closed[0].trigger, SubmapTrigger::kEnd);
}

TEST(SubmapBuilder, ClosesOnAGap) {
  Drive drive;
  drive.Straight(40.0);
  drive.Wait(20.0);
  drive.Straight(20.0);
  drive.Finish();
  ASSERT_EQ(drive.closed.size(), 2u);
  EXPECT_EQ(drive.closed[0].trigger, SubmapTrigger::kGap);
  EXPECT_LT(drive.closed[0].end + FromSeconds(19.0), drive.closed[1].start);
}

}  // namespace
}  // namespace seastitch
