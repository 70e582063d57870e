#include "products/survey.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <sstream>

#include "common/storage/submap_file.hpp"
#include "products/files/graph_files.hpp"
#include "products/map/depth_map.hpp"
#include "products/map/map_points.hpp"
#include "products/survey_collector.hpp"
#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

using testing::LoopEdge;
using testing::MakeDriftingSurvey;
using testing::SeenFrom;
using testing::SolutionAt;

TEST(SurveyCollector, WritesCloudsAndKeepsOnlyTheirMetadata) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  const Submap submap = SeenFrom(4, {5, 6, 1}, {5, 6, 1}, testing::Hills, 6, 6, 0.5, 0.0);
  collector.Add(submap);
  const Survey survey = collector.Finish();
  const SubmapPcd pcd = ReadSubmapPcd(folder / "submaps/submap_4.pcd");
  EXPECT_EQ(pcd.cloud.size(), submap.cloud.size());
  ASSERT_EQ(survey.submaps.size(), 1u);
  EXPECT_EQ(survey.submaps[0].points, submap.cloud.size());
  EXPECT_EQ(survey.submaps[0].soundings_read, submap.soundings_read);
  EXPECT_GE(survey.submaps[0].hull.size(), 4u);
}

// The inertial unit's clock was 100 s ahead, and came right.
TEST(SurveyCollector, ATrackThatBeginsAgainReplacesTheOneByAWrongClock) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  const auto add = [&](double from_s, int states) {
    for (int i = 0; i < states; ++i) {
      NavState state;
      state.time = FromUtime(0) + FromSeconds(from_s + 0.1 * i);
      collector.Add(state);
    }
  };
  add(100.0, 50);
  add(30.0, 5);  // a few stray ones
  add(105.0, 5);
  EXPECT_EQ(collector.states(), 55U);
  add(25.0, 40);
  const Survey survey = collector.Finish();
  ASSERT_EQ(survey.track.size(), 40U);
  EXPECT_EQ(survey.track.front().time, FromUtime(25'000'000));
}

TEST(SurveyCollector, CountsAndSkipsWhatItCannotUse) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  Submap submap = SeenFrom(0, {}, {}, testing::Hills, 4, 4, 0.5, 0.0);
  submap.cloud.Add({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  collector.Add(submap);
  collector.Add(submap);
  submap.id.value = 1;
  submap.T_map_submap.translation().x() = std::numeric_limits<double>::infinity();
  collector.Add(submap);
  Submap empty;
  empty.id.value = 2;
  collector.Add(empty);
  NavState state;
  state.time = FromUtime(10'000'000);
  collector.Add(state);
  collector.Add(state);
  state.T_map_vehicle.translation().y() = std::numeric_limits<double>::quiet_NaN();
  collector.Add(state);
  collector.Add(GraphUpdate{1, {}, {LoopEdge(0, 2)}});
  collector.Add(GraphUpdate{1, {}, {LoopEdge(0, 2)}});
  PoseGraph graph;
  graph.graph_version = 5;
  collector.Add(graph);
  graph.graph_version = 4;
  collector.Add(graph);
  const Survey survey = collector.Finish();
  EXPECT_EQ(survey.submaps.size(), 2u);
  EXPECT_EQ(survey.track.size(), 1u);
  EXPECT_EQ(survey.edges.size(), 1u);
  EXPECT_EQ(survey.solution.graph_version, 5);
  const std::map<std::string, std::uint64_t> expected = {{"graph_update_repeated", 1},
                                                         {"nav_not_finite", 1},
                                                         {"nav_out_of_order", 1},
                                                         {"pose_graph_older", 1},
                                                         {"submap_points_not_finite", 1},
                                                         {"submap_pose_not_finite", 1},
                                                         {"submap_repeated", 1},
                                                         {"submap_without_points", 1}};
  EXPECT_EQ(survey.counters, expected);
}

TEST(SurveyCollector, CountsAPairThatWasRegisteredAgainWithItsLastVerdict) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  GraphEdge refused = LoopEdge(0, 2);
  refused.verdict = LoopVerdict::kAmbiguous;
  GraphEdge dead_reckoned = LoopEdge(0, 2);
  dead_reckoned.kind = EdgeKind::kDeadReckoning;
  collector.Add(GraphUpdate{1, {}, {dead_reckoned, refused, LoopEdge(1, 2)}});
  collector.Add(GraphUpdate{2, {}, {LoopEdge(0, 2)}});
  const Survey survey = collector.Finish();
  ASSERT_EQ(survey.edges.size(), 3u);
  EXPECT_EQ(survey.edges[0].kind, EdgeKind::kDeadReckoning);
  EXPECT_EQ(survey.edges[1].from.value, 0);
  EXPECT_EQ(survey.edges[1].verdict, LoopVerdict::kAccepted);
}

TEST(SurveyCollector, ThinsAFastTrack) {
  const TemporaryDir folder;
  SurveyCollector collector(folder.path());
  NavState state;
  for (int i = 0; i < 1000; ++i) {
    state.time = FromUtime(10'000 * i);
    collector.Add(state);
  }
  EXPECT_EQ(collector.Finish().track.size(), 200u);
}

TEST(SurveyCollector, NamesTheFolderItCannotMake) {
  EXPECT_THROW(SurveyCollector("/proc/no/such"), std::runtime_error);
}

TEST(SolvedPoses, CarryTheLastCorrectionToSubmapsThatAreNotSolvedYet) {
  const TemporaryDir folder;
  const testing::DriftingSurvey drifting = MakeDriftingSurvey(1, 3);
  PoseGraph solution = SolutionAt(drifting.truth);
  solution.vertices.pop_back();
  const Survey survey = Collect(drifting, folder.path(), solution, {});
  const std::vector<Pose2> dead_reckoned = DeadReckonedPoses(survey).T_map_level;
  const std::vector<Pose2> solved = SolvedPoses(survey).T_map_level;
  EXPECT_EQ(solved[1].x, drifting.truth[1].x);
  const Pose2 step = Inverse(dead_reckoned[1]) * dead_reckoned[2];
  const Pose2 got = Inverse(solved[1]) * solved[2];
  EXPECT_NEAR((got.Vector() - step.Vector()).norm(), 0.0, 1e-9);
}

TEST(SolvedPoses, CarryTheVehicleAndNotItsSoundingsOn) {
  const TemporaryDir folder;
  testing::DriftingSurvey drifting = MakeDriftingSurvey(1, 2);
  drifting.submaps[1].T_map_submap = MakePose({20.0, 10.0, 5.0}, RotationFromRpy(0.0, 0.0, kPi));
  drifting.submaps[0].T_map_submap = MakePose({0.0, 0.0, 5.0}, Eigen::Matrix3d::Identity());
  PoseGraph solution = SolutionAt({{0.6, 0.2, 0.0}});
  solution.mounting[0].sonar_m = {0.6, 0.2};
  const Survey survey = Collect(drifting, folder.path(), solution, {});
  const SurveyPoses solved = SolvedPoses(survey);
  EXPECT_NEAR(solved.T_map_level[1].x, 20.0 - 0.6, 1e-9);
  EXPECT_NEAR(solved.T_map_level[1].y, 10.0 - 0.2, 1e-9);
}

TEST(SolvedPoses, HaveTheMountingErrorsOfTheirOwnDive) {
  Survey survey;
  for (int id = 0; id < 4; ++id) {
    SurveySubmap& submap = survey.submaps.emplace_back();
    submap.id.value = id;
    submap.chain = id / 2;
    submap.T_map_submap = MakePose({10.0 * id, 0.0, 5.0}, Eigen::Matrix3d::Identity());
  }
  survey.solution.mounting[0].sonar_m = {0.5, 0.0};
  survey.solution.mounting[1].sonar_m = {0.0, -0.25};
  const SurveyPoses solved = SolvedPoses(survey);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d told(10.0 * static_cast<double>(i), 0.0);
    const Eigen::Vector2d offset = i < 2 ? Eigen::Vector2d(0.5, 0.0) : Eigen::Vector2d(0.0, -0.25);
    EXPECT_LT((solved.T_map_level[i].Translation() - told - offset).norm(), 1e-9) << i;
    EXPECT_LT((solved.VehicleAt(i).Translation() - told).norm(), 1e-9) << i;
  }
}

TEST(SolvedPoses, RefuseAVertexThatIsNotFinite) {
  const TemporaryDir folder;
  const testing::DriftingSurvey drifting = MakeDriftingSurvey(1, 2);
  PoseGraph solution = SolutionAt(drifting.truth);
  solution.vertices[1].T_map_level.x = std::numeric_limits<double>::quiet_NaN();
  const Survey survey = Collect(drifting, folder.path(), solution, {});
  EXPECT_TRUE(SolvedPoses(survey).T_map_level[1].Vector().allFinite());
}

TEST(MapPoints, OfAZUpFrameAreTurnedToNorthEastDown) {
  EXPECT_EQ(ToNorthEastDown({1, 2, 3}, MapAxes::kEastNorthUp), Eigen::Vector3d(2, 1, -3));
  EXPECT_EQ(ToNorthEastDown({1, 2, 3}, MapAxes::kNorthEastDown), Eigen::Vector3d(1, 2, 3));
}

TEST(MapPoints, AreShearedInTheirLevelFrameByADvlThatIsTurned) {
  const TemporaryDir folder;
  Submap tilted = MakeDriftingSurvey(1, 2).submaps[0];
  tilted.T_map_submap.linear() = RotationFromRpy(0.1, -0.2, 0.7);
  SurveyCollector collector(folder.path());
  collector.Add(tilted);
  const Survey survey = collector.Finish();
  MountingErrors mounting;
  mounting.dvl_yaw_rad = 0.01;
  const PointCloud told = LoadCloud(survey.submaps[0], 0.0);
  const PointCloud sheared = LoadCloud(survey.submaps[0], mounting.dvl_yaw_rad);
  ASSERT_GT(told.size(), 100u);
  ASSERT_EQ(sheared.size(), told.size());
  EXPECT_EQ(sheared.soundings, told.soundings);
  const Eigen::Matrix3d R_level_submap = RotationFromRpy(0.1, -0.2, 0.0);
  for (std::size_t i = 0; i < told.size(); ++i) {
    const Eigen::Vector3d before = R_level_submap * told.points[i].cast<double>();
    const Eigen::Vector3d after = R_level_submap * sheared.points[i].cast<double>();
    EXPECT_LT((after - before - Eigen::Vector3d(0.0, 0.01 * before.x(), 0.0)).norm(), 1e-5);
  }
  const SurveyPoses poses{{{5.0, -3.0, 0.4}}, {mounting}};
  const Eigen::AlignedBox2d box = NorthEastBox(survey.submaps, poses, 0, MapProjection());
  for (const MapPoint& point : LoadMapPoints(survey.submaps, poses, 0, MapProjection()))
    EXPECT_TRUE(box.contains(point.p_ned.head<2>()));
  // Far from the map's origin, where the place in the files depends on the depth.
  const SurveyPoses far_poses{{{90'000.0, -120'000.0, 0.4}}, {mounting}};
  const MapProjection utm({57.1, 11.2}, Eigen::Vector2d::Zero(), "", 0);
  const Eigen::AlignedBox2d far = NorthEastBox(survey.submaps, far_poses, 0, utm);
  for (const MapPoint& point : LoadMapPoints(survey.submaps, far_poses, 0, utm))
    EXPECT_TRUE(far.contains(point.north_east));
}

TEST(MapPoints, DefaultCellIsTwiceThePointSpacingRoundedUp) {
  const TemporaryDir folder;
  const Survey survey = Collect(MakeDriftingSurvey(1, 3), folder.path(), {}, {});
  EXPECT_EQ(DefaultCell(survey.submaps), 1.0);  // 0.5 m apart
  EXPECT_EQ(DefaultCell({}), 1.0);
}

TEST(MapPoints, RoundUpToOneTwoFive) {
  EXPECT_DOUBLE_EQ(RoundUpOneTwoFive(1.0), 1.0);
  EXPECT_DOUBLE_EQ(RoundUpOneTwoFive(1.01), 2.0);
  EXPECT_DOUBLE_EQ(RoundUpOneTwoFive(0.21), 0.5);
  EXPECT_DOUBLE_EQ(RoundUpOneTwoFive(7.0), 10.0);
}

TEST(DepthCell, WeighsBySoundingsAndKeepsMillimetresInTheDeep) {
  DepthCell cell;
  cell.Add(6000.001, 3.0);
  cell.Add(6000.005, 1.0);
  EXPECT_NEAR(cell.mean_m, 6000.002, 1e-9);
  EXPECT_NEAR(cell.Spread(), std::sqrt((3 * 1e-6 + 9e-6) / 4), 1e-9);
  EXPECT_EQ(cell.soundings, 4.0);
}

TEST(PosesTxt, KeepsHeightRollAndPitchAndEveryDigit) {
  Survey survey;
  SurveySubmap s;
  s.id.value = 3;
  const Eigen::Vector3d rpy(0.1, -0.2, 0.3);
  s.T_map_submap = MakePose({1.0 / 3.0, 2.0 / 3.0, 40.123456789012345},
                            RotationFromRpy(rpy.x(), rpy.y(), rpy.z()));
  survey.submaps.push_back(s);
  const Pose2 corrected{6'500'000.0 + 1.0 / 3.0, -1e-7 / 3.0, 2.9};
  std::istringstream in(PosesTxt(survey, {corrected}));
  int id = 0;
  double x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
  in >> id >> x >> y >> z >> qx >> qy >> qz >> qw;
  EXPECT_EQ(id, 3);
  EXPECT_EQ(x, corrected.x);
  EXPECT_EQ(y, corrected.y);
  EXPECT_EQ(z, 40.123456789012345);
  const Eigen::Vector3d got =
      RpyFromRotation(Eigen::Quaterniond(qw, qx, qy, qz).toRotationMatrix());
  EXPECT_NEAR((got - Eigen::Vector3d(rpy.x(), rpy.y(), 2.9)).norm(), 0.0, 1e-12);
}

TEST(GraphG2o, IsWithoutTheErrorsOfMountingThatItsVerticesAreWithout) {
  const TemporaryDir folder;
  GraphEdge step;
  step.kind = EdgeKind::kDeadReckoning;
  step.from.value = 0;
  step.to.value = 1;
  step.T_from_to = {0.0, 20.0, kPi};
  step.information.setIdentity();
  const Survey survey = Collect(MakeDriftingSurvey(1, 2), folder.path(), {}, {step});
  SurveyPoses poses{{{0.0, 0.0, 0.0}, {-1.0, 20.0, kPi}}, {{}, {}}};
  for (MountingErrors& mounting : poses.mounting) mounting.sonar_m = {0.5, 0.0};
  std::istringstream in(GraphG2o(survey, poses));
  std::string line;
  while (std::getline(in, line) && line.rfind("EDGE_SE2", 0) != 0) {
  }
  std::string word;
  int from = 0, to = 0;
  double x = 0.0, y = 0.0;
  std::istringstream(line) >> word >> from >> to >> x >> y;
  EXPECT_NEAR(x, -1.0, 1e-9);
  EXPECT_NEAR(y, 20.0, 1e-9);
}

// The DVL's angle of either dive shears its own cloud, and turns it by half of that.
TEST(GraphG2o, CorrectsAClosureBetweenTwoDivesByTheErrorsOfBoth) {
  const TemporaryDir folder;
  GraphEdge closure = LoopEdge(0, 1);
  closure.T_from_to = {0.0, 20.0, kPi};
  closure.overlap_center_m = {8.0, 10.0};  // 8 m ahead of the first frame, 8 m behind the second
  Survey survey = Collect(MakeDriftingSurvey(1, 2), folder.path(), {}, {closure});
  survey.submaps[1].chain = 1;
  SurveyPoses poses{{{0.0, 0.0, 0.0}, {0.0, 20.0, kPi}}, {{}, {}}};
  poses.mounting[0].dvl_yaw_rad = 0.01;
  poses.mounting[1].dvl_yaw_rad = -0.02;
  std::istringstream in(GraphG2o(survey, poses));
  std::string line;
  while (std::getline(in, line) && line.rfind("EDGE_SE2", 0) != 0) {
  }
  std::string word;
  int from = 0, to = 0;
  double x = 0.0, y = 0.0;
  std::istringstream(line) >> word >> from >> to >> x >> y;
  const double turned_rad = 0.5 * (0.01 + 0.02);
  EXPECT_NEAR(x, turned_rad * (10.0 - 20.0), 1e-9);
  EXPECT_NEAR(y, 20.0 + 0.01 * 8.0 + 0.02 * 8.0 - turned_rad * 8.0, 1e-9);
}

TEST(GraphG2o, HoldsVerticesTheFixedFirstAndOnlyEdgesThatPull) {
  Survey survey;
  for (int i = 0; i < 3; ++i) {
    SurveySubmap s;
    s.id.value = i;
    survey.submaps.push_back(s);
  }
  GraphEdge fix = LoopEdge(1, 1);
  fix.kind = EdgeKind::kPositionFix;
  survey.edges = {LoopEdge(0, 2), LoopEdge(0, 1, LoopVerdict::kAmbiguous), LoopEdge(0, 9), fix};
  std::istringstream in(GraphG2o(survey, {{{0, 0, 0}, {1, 2, 3}, {4, 5, 6}}, {}}));
  int vertices = 0, edges = 0, priors = 0;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    std::vector<double> v;
    for (double number = 0; words >> number;) v.push_back(number);
    if (tag == "VERTEX_SE2") {
      EXPECT_EQ(v.size(), 4u);
      ++vertices;
    } else if (tag == "FIX") {
      EXPECT_EQ(v, std::vector<double>{0});
    } else if (tag == "EDGE_SE2") {
      EXPECT_EQ(v, (std::vector<double>{0, 2, 1, 2, 0.1, 4, 1, 0, 5, 0, 900}));
      ++edges;
    } else if (tag == "EDGE_PRIOR_SE2") {
      EXPECT_EQ(v.size(), 10u);
      ++priors;
    } else {
      ADD_FAILURE() << line;
    }
  }
  EXPECT_EQ(vertices, 3);
  EXPECT_EQ(edges, 1);
  EXPECT_EQ(priors, 1);
}

}  // namespace
}  // namespace seastitch
