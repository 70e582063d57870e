#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "optimizer/solver/graph_builder.hpp"
#include "optimizer/solver/robust_solver.hpp"
#include "tests/optimizer/graph_fixtures.hpp"

// Errors of the mounting of sonar and Doppler log in the graph.
namespace seastitch {
namespace {

MountingErrors WrongMounting() {
  MountingErrors errors;
  errors.sonar_m = {-0.6, 0.3};
  errors.dvl_yaw_rad = Deg2Rad(0.5);
  return errors;
}

// A survey as it looks with sensors that are not mounted as told.
std::vector<GraphUpdate> SeenWrong(const SurveyGraph& survey, const MountingSigmas& sigmas) {
  const MountingErrors errors = WrongMounting();
  std::vector<GraphUpdate> updates = survey.updates;
  for (GraphUpdate& update : updates) {
    update.mounting = sigmas;
    for (GraphEdge& edge : update.edges) {
      const Pose2 T = edge.T_from_to;
      if (edge.kind == EdgeKind::kDeadReckoning) {
        const Eigen::Vector2d t = Pose2{0.0, 0.0, -errors.dvl_yaw_rad}.Rotation() * T.Translation();
        edge.T_from_to = {t.x(), t.y(), T.yaw};
      } else {
        edge.overlap_center_m = 0.5 * T.Translation();
        const Pose2 measured = Inverse(SoundingPose({}, errors)) * SoundingPose(T, errors);
        const Eigen::Vector3d told =
            measured.Vector() -
            LoopClosureByMounting(measured, edge.overlap_center_m) * errors.Vector();
        edge.T_from_to = {told.x(), told.y(), told.z()};
      }
    }
  }
  return updates;
}

// Two dives of two vehicles over one area: the second has the lines from kSecondDive on. Closures
// alone join them.
constexpr int kSecondDive = 160;

std::int32_t ChainOf(SubmapId id) { return id.value < kSecondDive ? 0 : 1; }

// Of where the vehicle was, after the rigid motion that lays it best on the truth.
double ShapeRms(const PoseGraph& solution, const std::vector<Pose2>& truth) {
  const auto n = static_cast<Eigen::Index>(truth.size());
  Eigen::Matrix2Xd found(2, n), expected(2, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Pose2& T = solution.vertices[static_cast<std::size_t>(k)].T_map_level;
    const std::int32_t chain = solution.mounting.size() > 1
                                   ? ChainOf(solution.vertices[static_cast<std::size_t>(k)].id)
                                   : 0;
    found.col(k) = VehiclePose(T, solution.MountingOf(chain)).Translation();
    expected.col(k) = truth[static_cast<std::size_t>(k)].Translation();
  }
  const Eigen::Matrix3d fit = Eigen::umeyama(found, expected, false);
  const Eigen::Matrix2Xd fitted =
      (fit.topLeftCorner<2, 2>() * found).colwise() + Eigen::Vector2d(fit.topRightCorner<2, 1>());
  return (fitted - expected).norm() / std::sqrt(static_cast<double>(n));
}

// The shape that can be had of a survey whose mounting is known to this covariance: an angle off by
// its sigma leaves lines of opposite heading in a fishbone.
double ShapeToBeHad(double where_mounting_is_known_m,
                    const MountingErrors& mounting,
                    double line_m) {
  const double fishbone_m = line_m / std::sqrt(12.0) * std::sqrt(mounting.covariance(2, 2));
  return std::hypot(where_mounting_is_known_m, fishbone_m);
}

TEST(PoseGraphOptimizer, FindsErrorsOfMountingThatAllSubmapsOfADiveShare) {
  const SurveyGraph survey =
      SimulateSurvey({.vertices = 300, .per_line = 20, .sigma_m = 0.1, .seed = 5});
  const MountingErrors wrong = WrongMounting();
  const PoseGraph right = SolveAll(survey.updates);
  const PoseGraph blind = SolveAll(SeenWrong(survey, {}));
  const PoseGraph found = SolveAll(SeenWrong(survey, {0.5, Deg2Rad(0.5)}));
  const Eigen::Vector3d error = found.MountingOf(0).Vector() - wrong.Vector();
  const Eigen::Vector3d sigma = found.MountingOf(0).covariance.diagonal().cwiseSqrt();
  EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 3.0);
  EXPECT_LT(sigma.cwiseQuotient(wrong.Vector().cwiseAbs()).maxCoeff(), 0.25);
  EXPECT_LT(ShapeRms(found, survey.truth),
            ShapeToBeHad(ShapeRms(right, survey.truth), found.MountingOf(0), 800.0));
  EXPECT_GT(ShapeRms(blind, survey.truth), 3.0 * ShapeRms(found, survey.truth));
  EXPECT_EQ(blind.MountingOf(0).Vector(), Eigen::Vector3d::Zero());
  EXPECT_EQ(blind.MountingOf(0).covariance, Eigen::Matrix3d::Zero());
}

// The first edges were measured by a wrong angle of the DVL, the last ones by the right one: what
// navigation learnt corrects the first.
TEST(PoseGraphOptimizer, EdgesAreCorrectedByWhatNavigationLearntOfTheDvlsAngle) {
  const SurveyGraph survey =
      SimulateSurvey({.vertices = 300, .per_line = 20, .sigma_m = 0.1, .seed = 5});
  std::vector<GraphUpdate> learning = survey.updates;
  const std::size_t first = learning.size() / 3;
  for (std::size_t i = 0; i < learning.size(); ++i) {
    for (GraphEdge& edge : learning[i].edges) {
      if (edge.from == edge.to) continue;
      if (edge.kind == EdgeKind::kLoopClosure)
        edge.overlap_center_m = 0.5 * edge.T_from_to.Translation();
      edge.dvl_yaw_rad = Deg2Rad(i < first ? -0.6 : 0.2);
      const Eigen::Vector3d measured =
          edge.T_from_to.Vector() -
          (Deg2Rad(0.2) - edge.dvl_yaw_rad) * ByMounting(edge, true).of_to.col(2);
      edge.T_from_to = {measured.x(), measured.y(), measured.z()};
    }
  }
  const PoseGraph right = SolveAll(survey.updates);
  const double known_m = ShapeRms(SolveAll(learning), survey.truth);
  for (GraphUpdate& update : learning)
    for (GraphEdge& edge : update.edges) edge.dvl_yaw_rad = 0.0;
  EXPECT_NEAR(known_m, ShapeRms(right, survey.truth), 0.02);
  EXPECT_GT(ShapeRms(SolveAll(learning), survey.truth), 2.0 * known_m);
}

// A dive of one submap has no dead reckoning that says what navigation knows last: its closures
// stand as they were measured.
TEST(PoseGraphOptimizer, AClosureToADiveOfOneSubmapIsNotCorrected) {
  const auto solved = [](double dvl_yaw_rad) {
    std::vector<GraphUpdate> updates = DriftingSquare();
    GraphUpdate single;
    single.version = updates.back().version + 1;
    const int last = updates.back().vertices.back().id.value;
    GraphVertex vertex = updates.back().vertices.back();
    vertex.id = SubmapId{last + 1};
    vertex.chain = 1;
    single.vertices = {vertex};
    single.edges = {
        Edge(EdgeKind::kLoopClosure, last, last + 1, {30.0, 4.0, 0.1}, 0.05, Deg2Rad(0.1))};
    single.edges[0].overlap_center_m = {20.0, 0.0};
    single.edges[0].dvl_yaw_rad = dvl_yaw_rad;
    updates.push_back(single);
    return SolveAll(updates).vertices.back().T_map_level.Vector();
  };
  EXPECT_EQ(solved(0.0), solved(0.02));
}

std::array<MountingErrors, 2> WrongMountings() {
  MountingErrors second;
  second.sonar_m = {0.5, -0.4};
  second.dvl_yaw_rad = Deg2Rad(-0.3);
  return {WrongMounting(), second};
}

SurveyGraph TwoDives() {
  return SimulateSurvey({.vertices = 300, .per_line = 20, .sigma_m = 0.1, .seed = 5});
}

std::vector<GraphUpdate> SeenWrongByTwo(const SurveyGraph& survey, const MountingSigmas& sigmas) {
  const std::array<MountingErrors, 2> of_dives = WrongMountings();
  std::vector<GraphUpdate> updates = survey.updates;
  for (GraphUpdate& update : updates) {
    update.mounting = sigmas;
    update.vertices[0].chain = ChainOf(update.vertices[0].id);
    std::erase_if(update.edges, [](const GraphEdge& edge) {
      return edge.kind == EdgeKind::kDeadReckoning && ChainOf(edge.from) != ChainOf(edge.to);
    });
    for (GraphEdge& edge : update.edges) {
      const auto from = static_cast<std::size_t>(ChainOf(edge.from));
      const auto to = static_cast<std::size_t>(ChainOf(edge.to));
      const Pose2 T = edge.T_from_to;
      if (edge.kind == EdgeKind::kDeadReckoning) {
        MountingErrors opposite;
        opposite.dvl_yaw_rad = -of_dives[to].dvl_yaw_rad;
        edge.T_from_to = TravelledPose(T, opposite);
      } else {
        edge.overlap_center_m = 0.5 * T.Translation();
        const Pose2 measured =
            Inverse(SoundingPose({}, of_dives[from])) * SoundingPose(T, of_dives[to]);
        edge.T_from_to = measured;
        const EdgeByMounting by = ByMounting(edge, from == to);
        const Eigen::Vector3d told =
            measured.Vector() - MountingCorrection(by, of_dives[from], of_dives[to]);
        edge.T_from_to = {told.x(), told.y(), told.z()};
      }
    }
  }
  return updates;
}

// The solution of the same factors with one set of mounting errors for both dives.
PoseGraph SolvedWithOneSet(const std::vector<GraphUpdate>& updates) {
  const OptimizerParams params;
  GraphStore store;
  for (const GraphUpdate& update : updates) store.Add(update);
  FactorGraph graph = BuildFactorGraph(store, params);
  const int second = graph.num_vertices - 1, shared = second - 1;
  for (Factor& factor : graph.factors) {
    std::array<MountingTerm, 2>& terms = factor.mounting;
    for (MountingTerm& term : terms)
      if (term.vertex == second) term.vertex = shared;
    if (terms[0].vertex != terms[1].vertex) continue;
    terms[0].by += terms[1].by;
    terms[1] = {};
  }
  std::vector<Pose2> dead_reckoned;
  for (const auto& [id, vertex] : store.vertices()) dead_reckoned.push_back(vertex.dead_reckoned);
  dead_reckoned.resize(static_cast<std::size_t>(graph.num_vertices));
  const RobustSolution solution = SolveRobustly(graph, {dead_reckoned}, params);
  const auto k = static_cast<std::size_t>(shared);
  const Pose2& errors = solution.T_map_vertex[k];
  PoseGraph out;
  for (std::size_t v = 0; v < store.vertices().size(); ++v)
    out.vertices.push_back({SubmapId{static_cast<int>(v)},
                            solution.T_map_vertex[v],
                            Eigen::Matrix3d::Zero(),
                            Eigen::Matrix3d::Zero()});
  out.mounting[0] = {errors.Translation(), errors.yaw, solution.covariance->marginal()[k]};
  out.mounting[1] = out.mounting[0];
  return out;
}

// Largest error of the estimated mounting of any of the two dives, in its sigmas.
double WorstOfMountings(const PoseGraph& solution) {
  double worst = 0.0;
  for (const std::int32_t chain : {0, 1}) {
    const MountingErrors found = solution.MountingOf(chain);
    const Eigen::Vector3d error =
        found.Vector() - WrongMountings()[static_cast<std::size_t>(chain)].Vector();
    const Eigen::Vector3d sigma = found.covariance.diagonal().cwiseSqrt();
    worst = std::max(worst, error.cwiseQuotient(sigma).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(PoseGraphOptimizer, FindsTheMountingErrorsOfEachOfTwoVehicles) {
  const SurveyGraph survey = TwoDives();
  const PoseGraph right = SolveAll(survey.updates);
  const std::vector<GraphUpdate> updates = SeenWrongByTwo(survey, {0.5, Deg2Rad(0.5)});
  const PoseGraph found = SolveAll(updates);
  const PoseGraph shared = SolvedWithOneSet(updates);
  EXPECT_LT(WorstOfMountings(found), 3.0);
  EXPECT_GT(WorstOfMountings(shared), 10.0);
  for (const auto& [chain, errors] : found.mounting) {
    const Eigen::Vector3d wrong = WrongMountings()[static_cast<std::size_t>(chain)].Vector();
    const Eigen::Vector3d sigma = errors.covariance.diagonal().cwiseSqrt();
    EXPECT_LT(sigma.cwiseQuotient(wrong.cwiseAbs()).maxCoeff(), 0.25) << chain;
  }
  const double own_m = ShapeRms(found, survey.truth), one_m = ShapeRms(shared, survey.truth);
  std::printf("shape: %.3f m with own errors, %.3f m with one set, %.3f m without errors\n",
              own_m,
              one_m,
              ShapeRms(right, survey.truth));
  EXPECT_LT(own_m, ShapeToBeHad(ShapeRms(right, survey.truth), found.MountingOf(0), 800.0));
  EXPECT_GT(one_m, 3.0 * own_m);
}

// The part of a survey that one dive mapped.
SurveyGraph PartOf(const SurveyGraph& survey, std::int32_t chain) {
  SurveyGraph part;
  for (std::size_t k = 0; k < survey.truth.size(); ++k) {
    if (ChainOf(SubmapId{static_cast<int>(k)}) != chain) continue;
    part.truth.push_back(survey.truth[k]);
    part.updates.push_back(survey.updates[k]);
    part.updates.back().version = static_cast<std::int64_t>(part.updates.size());
    std::erase_if(part.updates.back().edges,
                  [chain](const GraphEdge& edge) { return ChainOf(edge.from) != chain; });
  }
  return part;
}

TEST(PoseGraphOptimizer, ADiveAmongOthersIsAsGoodAsAlone) {
  const SurveyGraph survey = TwoDives();
  SurveyGraph seen = survey;
  seen.updates = SeenWrongByTwo(survey, {0.5, Deg2Rad(0.5)});
  const PoseGraph together = SolveAll(seen.updates);
  for (const std::int32_t chain : {0, 1}) {
    const SurveyGraph part = PartOf(seen, chain);
    const PoseGraph alone = SolveAll(part.updates);
    PoseGraph of_dive = together;
    std::erase_if(of_dive.vertices,
                  [chain](const SolvedVertex& vertex) { return ChainOf(vertex.id) != chain; });
    const double alone_m = ShapeRms(alone, part.truth), together_m = ShapeRms(of_dive, part.truth);
    std::printf("dive %d: shape %.3f m alone, %.3f m with the other\n", chain, alone_m, together_m);
    EXPECT_LT(together_m, 1.1 * alone_m);
    for (int k = 0; k < 3; ++k)
      EXPECT_LT(together.MountingOf(chain).covariance(k, k),
                1.001 * alone.MountingOf(chain).covariance(k, k));
  }
}

TEST(GraphStore, KeepsTheSigmasOfEachDive) {
  GraphStore store;
  GraphUpdate first{1, {{SubmapId{0}, {}, {}, {}, 0}}, {}};
  first.mounting = {0.3, 0.01};
  GraphUpdate second{2, {{SubmapId{1}, {}, {}, {}, 2}}, {}};
  second.mounting = {0.0, 0.02};
  GraphUpdate known{3, {{SubmapId{2}, {}, {}, {}, 5}}, {}};  // nothing is to be estimated
  GraphUpdate refused{4, {{SubmapId{3}, {}, {}, {}, 4}}, {}};
  refused.mounting = {0.7, 0.7};
  GraphUpdate damaged{5, {{SubmapId{4}, {}, {}, {}, 5}}, {}};
  damaged.mounting.sonar_m = -1.0;
  for (const GraphUpdate& update : {first, second, known, refused, damaged})
    ASSERT_TRUE(store.Add(update));
  ASSERT_EQ(store.mounting().size(), 2u);
  EXPECT_EQ(store.mounting().at(0).sonar_m, 0.3);
  EXPECT_EQ(store.mounting().at(2).dvl_yaw_rad, 0.02);
  EXPECT_EQ(store.counters().at("vertices_malformed"), 1) << "chains rise";
  EXPECT_EQ(store.counters().at("mounting_unusable"), 1);
  const FactorGraph graph = BuildFactorGraph(store, {});
  EXPECT_EQ(graph.num_mountings, 2);
  EXPECT_EQ(graph.num_vertices, 4 + 2);
}

// One dive whose mounting is known, and one whose is not.
TEST(PoseGraphOptimizer, EachDiveHasItsOwnSigmas) {
  std::vector<GraphUpdate> updates = SeenWrongByTwo(TwoDives(), {0.5, Deg2Rad(0.5)});
  for (GraphUpdate& update : updates)
    if (update.vertices[0].chain == 0) update.mounting = {};
  const PoseGraph solution = SolveAll(updates);
  ASSERT_EQ(solution.mounting.size(), 1u);
  EXPECT_EQ(solution.MountingOf(0).Vector(), Eigen::Vector3d::Zero());
  EXPECT_GT(solution.MountingOf(1).covariance(0, 0), 0.0);
}

TEST(PoseGraphOptimizer, AFurtherDiveContinuesASolution) {
  const SurveyGraph survey = TwoDives();
  const std::vector<GraphUpdate> updates = SeenWrongByTwo(survey, {0.5, Deg2Rad(0.5)});
  PoseGraphOptimizer incremental{OptimizerParams{}};
  for (const GraphUpdate& update : updates) {
    ASSERT_TRUE(incremental.Add(update));
    if (update.version % 20 != 1) continue;
    ASSERT_TRUE(incremental.Solve());
  }
  const PoseGraph batch = SolveAll(updates);
  const PoseGraph last = *incremental.Solve();
  ASSERT_EQ(last.mounting.size(), 2u);
  for (const std::int32_t chain : {0, 1})
    EXPECT_LT((last.MountingOf(chain).Vector() - batch.MountingOf(chain).Vector()).norm(), 1e-4);
  EXPECT_LT(LargestDifference(last, batch), 1e-3);
}

TEST(PoseGraphOptimizer, FindsNoErrorsOfMountingWhereThereAreNone) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 120, .per_line = 10, .seed = 6});
  std::vector<GraphUpdate> updates = survey.updates;
  for (GraphUpdate& update : updates) update.mounting = {0.1, Deg2Rad(0.1)};
  const PoseGraph sought = SolveAll(updates);
  const Eigen::Vector3d sigma = sought.MountingOf(0).covariance.diagonal().cwiseSqrt();
  EXPECT_LT(sought.MountingOf(0).Vector().cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 3.0);
  const double where_known_m = ShapeRms(SolveAll(survey.updates), survey.truth);
  EXPECT_LT(ShapeRms(sought, survey.truth),
            ShapeToBeHad(where_known_m, sought.MountingOf(0), 400.0));
}

TEST(PoseGraphOptimizer, ErrorsOfMountingAreThoseKnownBeforehandWhereNoClosureTells) {
  SurveyGraph survey = SimulateSurvey({.vertices = 10, .per_line = 10, .closures = 0});
  const PoseGraph solution = SolveAll(SeenWrong(survey, {0.2, 0.0}));
  EXPECT_LT(solution.MountingOf(0).Vector().norm(), 1e-9);
  EXPECT_NEAR(std::sqrt(solution.MountingOf(0).covariance(0, 0)), 0.2, 1e-9);
  EXPECT_NEAR(std::sqrt(solution.MountingOf(0).covariance(1, 1)), 0.2, 1e-9);
  EXPECT_EQ(solution.MountingOf(0).dvl_yaw_rad, 0.0);
  EXPECT_EQ(solution.MountingOf(0).covariance.row(2).norm(), 0.0);
}

TEST(PoseGraphOptimizer, ErrorsOfMountingAreTheSameInBatchAndIncremental) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 60, .per_line = 10, .seed = 8});
  const std::vector<GraphUpdate> updates = SeenWrong(survey, {0.5, Deg2Rad(0.5)});
  PoseGraphOptimizer incremental{OptimizerParams{}};
  PoseGraph last;
  for (const GraphUpdate& update : updates) {
    ASSERT_TRUE(incremental.Add(update));
    last = *incremental.Solve();
  }
  const PoseGraph batch = SolveAll(updates);
  EXPECT_LT((last.MountingOf(0).Vector() - batch.MountingOf(0).Vector()).norm(), 1e-4);
  EXPECT_LT(LargestDifference(last, batch), 1e-3);
  last = *incremental.Solve(SolveStart::kFromDeadReckoning);
  EXPECT_EQ(last.MountingOf(0).Vector(), batch.MountingOf(0).Vector());
  EXPECT_EQ(LargestDifference(last, batch), 0.0);
}

// Of the vehicle, against where it was in the map.
double AbsoluteRms(const PoseGraph& solution, const std::vector<Pose2>& truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Pose2 vehicle = VehiclePose(solution.vertices[k].T_map_level, solution.MountingOf(0));
    sum += (vehicle.Translation() - truth[k].Translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(PoseGraphOptimizer, StartHeadingsAndFixesAreOfTheVehicleWhereverItsSonarIs) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 60, .per_line = 10, .seed = 9});
  for (const bool with_fixes : {false, true}) {
    for (const bool with_headings : {false, true}) {
      SCOPED_TRACE(std::to_string(with_fixes) + std::to_string(with_headings));
      std::vector<GraphUpdate> updates = SeenWrong(survey, {0.5, Deg2Rad(0.1)});
      for (GraphUpdate& update : updates) {
        GraphVertex& vertex = update.vertices[0];
        vertex.heading_sigma_rad = with_headings ? std::optional(1e-3) : std::nullopt;
        const auto k = static_cast<std::size_t>(vertex.id.value);
        vertex.dead_reckoned.yaw = survey.truth[k].yaw;
        if (!with_fixes || k % 7 != 0) continue;
        update.edges.push_back(Fix(vertex.id.value, survey.truth[k].x, survey.truth[k].y, 0.02));
        update.edges.back().T_from_to.yaw = survey.truth[k].yaw;
      }
      const PoseGraph solution = SolveAll(updates);
      const Pose2 first = VehiclePose(solution.vertices[0].T_map_level, solution.MountingOf(0));
      EXPECT_LT((first.Translation() - survey.truth[0].Translation()).norm(), 0.05);
      if (with_fixes) {
        EXPECT_LT(AbsoluteRms(solution, survey.truth), 0.2);
      }
    }
  }
}

TEST(PoseGraphOptimizer, ErrorsOfMountingAreSoughtWhereAnUpdateSaysNothingOfThem) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 40, .per_line = 10});
  std::vector<GraphUpdate> updates = SeenWrong(survey, {0.5, Deg2Rad(0.5)});
  const PoseGraph before = SolveAll(updates);
  updates.push_back({41, {}, {}});
  EXPECT_EQ(SolveAll(updates).MountingOf(0).Vector(), before.MountingOf(0).Vector());
  updates[40].mounting.sonar_m = std::numeric_limits<double>::quiet_NaN();
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_EQ(optimizer.Solve()->MountingOf(0).Vector(), before.MountingOf(0).Vector());
  EXPECT_EQ(optimizer.counters().at("mounting_unusable"), 1);
}

TEST(PoseGraphOptimizer, AnotherMountingOrPlaceOfAClosureIsAnotherGraph) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  GraphUpdate other = updates[4];
  other.mounting.sonar_m = 0.1;
  EXPECT_TRUE(optimizer.store().Contradicts(other));
  other = updates[4];
  other.edges.back().overlap_center_m.x() = 1.0;
  EXPECT_TRUE(optimizer.store().Contradicts(other));
}

}  // namespace
}  // namespace seastitch
