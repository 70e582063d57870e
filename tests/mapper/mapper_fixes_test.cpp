#include "tests/mapper/mapper_fixtures.hpp"

namespace seastitch {
namespace {

class MapperWithFixes : public ::testing::TestWithParam<int> {};

// Fixes at the surface before the first ping.
TEST_P(MapperWithFixes, SendsThemAllToTheOptimizerInMessagesThatFit) {
  MapperParams params;
  params.navigation.fix_interval_s = 0.1;
  Embedding dive(params);
  dive.vehicle.sonar_on = false;
  dive.Drive(2.0);
  for (int n = 0; n < GetParam(); ++n) {
    dive.Drive(0.14);
    PositionFix fix;
    fix.time = dive.vehicle.time;
    fix.covariance_north_east_m2 = 9.0 * Eigen::Matrix2d::Identity();
    dive.mapper.Add(fix);
  }
  dive.Drive(2.0);
  dive.vehicle.sonar_on = true;
  dive.Drive(30.0);
  dive.Finish();

  EXPECT_EQ(dive.mapper.counters().at("position_fixes_in_graph"), GetParam());
  PoseGraphOptimizer optimizer({});
  std::int64_t version = 0;
  for (const GraphStep& step : dive.steps) {
    const auto received = FromLcm(ToLcm(step.update, step.submap_time, version));
    ASSERT_TRUE(received.has_value()) << step.update.version;
    EXPECT_EQ(received->version, ++version);
    EXPECT_TRUE(optimizer.Add(*received)) << version;
  }
  const std::optional<PoseGraph> solution = optimizer.Solve(SolveStart::kFromDeadReckoning);
  ASSERT_TRUE(solution);
  EXPECT_EQ(solution->vertices.size(), dive.submaps.size());
  EXPECT_EQ(static_cast<int>(optimizer.store().fixes().size()), GetParam());
}
INSTANTIATE_TEST_SUITE_P(Numbers, MapperWithFixes, ::testing::Values(0, 199, 200, 201, 500));

// --- the first fix is one of many ---------------------------------------------------------------

class FirstFix : public ::testing::TestWithParam<double> {
 protected:
  FirstFix() : dive(Params()) {}
  static MapperParams Params() {
    MapperParams params;
    params.navigation.start_at_first_fix = true;
    params.navigation.fix_interval_s = 5.0;
    return params;
  }
  void AddFix(double off_m) { dive.mapper.Add(dive.vehicle.Fix("gps", {off_m, 0.0})); }
  // Distance of the solved map from the truth, at its last submap [m].
  double OffM() {
    PoseGraphOptimizer optimizer({});
    for (const GraphStep& step : dive.steps) optimizer.Add(step.update);
    const std::optional<PoseGraph> solution = optimizer.Solve(SolveStart::kFromDeadReckoning);
    const auto last = std::prev(dive.submaps.end())->second;
    const Eigen::Vector2d truth = dive.vehicle.TrueAt(last->frame_time).translation().head<2>();
    return (solution->vertices.back().T_map_level.Translation() - truth).norm();
  }
  bool Says(const ConditionKind& kind) const {
    const auto now = dive.mapper.conditions();
    return std::any_of(now.begin(), now.end(), [&](const Condition& c) { return c.kind == &kind; });
  }

  Embedding dive;
};

TEST_P(FirstFix, ThatIsWrongIsOutvoted) {
  dive.Drive(0.1);
  AddFix(GetParam());
  for (int i = 0; i < 60; ++i) {
    dive.Drive(1.0);
    AddFix(0.0);
  }
  dive.Drive(60.0);
  EXPECT_FALSE(Says(conditions::kPlaceFromOneFix));
  dive.Finish();
  ASSERT_GE(dive.submaps.size(), 2u);
  EXPECT_LT(OffM(), 0.5);
}
INSTANTIATE_TEST_SUITE_P(Errors, FirstFix, ::testing::Values(0.0, 20.0, 300.0));

TEST_F(FirstFix, WithoutAnotherIsNamed) {
  dive.Drive(0.1);
  AddFix(20.0);
  dive.Drive(120.0);
  EXPECT_TRUE(Says(conditions::kPlaceFromOneFix));
  dive.Finish();
  EXPECT_NEAR(OffM(), 20.0, 0.5) << "the only fix places the map";
}

TEST(Mapper, SaysThatTheOptimizerIsSilent) {
  MapperParams params;
  params.submap.max_duration_s = 20.0;
  Embedding dive(params);
  double uptime_s = 0.0;
  const auto listen = [&](std::set<std::string> processes, double duration_s) {
    for (double t = 0.0; t < duration_s; t += 1.0) {
      dive.Drive(1.0);
      uptime_s += 1.0;
      for (const std::string& process : processes)
        dive.mapper.OnHeartbeat(
            {process, FromUtime(1'700'000'000'000'000) + FromSeconds(uptime_s), uptime_s});
    }
  };
  const auto says = [&] {
    const auto now = dive.mapper.conditions();
    return std::any_of(now.begin(), now.end(), [](const Condition& c) {
      return c.kind == &conditions::kNoOptimizer;
    });
  };
  listen({"logger", "optimizer"}, 60.0);
  ASSERT_FALSE(dive.steps.empty());
  EXPECT_FALSE(says()) << "it is there, and may be at work";
  listen({"logger"}, 9.0);
  EXPECT_FALSE(says());
  listen({"logger"}, 3.0);
  EXPECT_TRUE(says());
  PoseGraphOptimizer optimizer({});
  for (const GraphStep& step : dive.steps) optimizer.Add(step.update);
  PoseGraph solution = optimizer.Solve().value();
  solution.graph_id = dive.steps.front().update.graph_id;
  EXPECT_TRUE(dive.mapper.Take(solution));
  EXPECT_FALSE(says()) << "all is solved, as in a replay";
}

// The start position is unknown. A fix minutes later is 500 m off the assumed one.
TEST(Mapper, AnUnknownPlaceIsNoEdgeAndALaterFixPlacesTheWholeMap) {
  constexpr double kOffM = 500.0;
  MapperParams params;
  params.navigation.start_at_first_fix = true;
  Embedding dive(params);
  dive.Drive(120.0);
  dive.mapper.Add(dive.vehicle.Fix("gps", {kOffM, 0.0}));
  dive.Drive(60.0);
  dive.Finish();

  for (const GraphEdge& edge : dive.Edges(EdgeKind::kDeadReckoning))
    EXPECT_NE(edge.from, edge.to) << "nothing is known of the start";
  ASSERT_EQ(dive.Edges(EdgeKind::kPositionFix).size(), 1u);
  PoseGraphOptimizer optimizer({});
  for (const GraphStep& step : dive.steps) ASSERT_TRUE(optimizer.Add(step.update));
  const auto solution = optimizer.Solve(SolveStart::kFromDeadReckoning);
  ASSERT_TRUE(solution);
  for (const SolvedVertex& vertex : solution->vertices) {
    const double true_m =
        dive.vehicle.TrueAt(dive.submaps.at(vertex.id)->frame_time).translation().x() + kOffM;
    EXPECT_NEAR(vertex.T_map_level.x, true_m, 3.0) << vertex.id.value;
  }
}

// Acoustic fixes arrive 1 to 60 s late and out of order, GPS fixes at once. Every fix is used or
// counted.
TEST(Mapper, EveryLateFixThatThinningKeepsIsInTheGraph) {
  Embedding dive;
  std::multimap<Time, PositionFix> waiting;  // by arrival
  int sent = 0;
  const auto send = [&](const char* source, double age_s) {
    const PositionFix fix = dive.vehicle.Fix(source);
    waiting.emplace(fix.time + FromSeconds(age_s), fix);
    ++sent;
  };
  const auto deliver = [&](Time until) {
    while (!waiting.empty() && waiting.begin()->first <= until) {
      dive.mapper.Add(waiting.begin()->second);
      waiting.erase(waiting.begin());
    }
  };
  constexpr int kSeconds = 300;
  for (int i = 0; i < kSeconds; ++i) {
    dive.Drive(1.0);
    if (i % 4 == 0) send("usbl", 1.0 + 59.0 * (i * 37 % 100) / 99.0);
    if (i % 2 == 0) send("gps", 0.1);
    deliver(dive.vehicle.time);
  }
  dive.Drive(61.0);
  deliver(dive.vehicle.time);
  PositionFix ancient;
  ancient.time = dive.vehicle.time - FromSeconds(4000.0);
  ancient.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  dive.mapper.Add(ancient);
  dive.Drive(5.0);
  dive.Finish();

  const std::map<std::string, std::int64_t> counters = dive.mapper.counters();
  const auto count = [&](const char* name) {
    const auto found = counters.find(name);
    return found == counters.end() ? 0 : found->second;
  };
  const std::vector<GraphEdge> edges = dive.Edges(EdgeKind::kPositionFix);
  EXPECT_EQ(static_cast<std::int64_t>(edges.size()), count("position_fixes_in_graph"));
  EXPECT_EQ(count("position_fixes_in_graph") + count("nav_fix_thinned"), sent);
  EXPECT_EQ(count("nav_fix_late"), 1) << "older than anything that is remembered";
  EXPECT_EQ(count("position_fixes_too_far"), 0);
  EXPECT_GT(count("nav_fix_late_taken"), kSeconds / 20);
  // One fix in 10 s per source.
  EXPECT_GE(edges.size(), static_cast<std::size_t>(2 * kSeconds / 20));
  EXPECT_LE(edges.size(), static_cast<std::size_t>(2 * kSeconds / 10 + 2));
  // Each fix agrees with the position of its submap.
  for (const GraphEdge& edge : edges) {
    const Pose2 truth = LevelPose(dive.vehicle.TrueAt(dive.submaps.at(edge.to)->frame_time));
    const Eigen::Vector3d error = edge.T_from_to.Vector() - truth.Vector();
    EXPECT_LT(error.dot(edge.information * error), 16.3);
  }
}

bool SaysThatThePlaceIsUnknown(const Mapper& mapper) {
  const std::vector<Condition> now = mapper.conditions();
  return std::any_of(now.begin(), now.end(), [](const Condition& condition) {
    return condition.kind == &conditions::kPlaceUnknown;
  });
}

// Live, with an optimizer that answers; the first fix comes after an hour, 7 km off the datum.
TEST(Mapper, TheFirstFixAfterAnHourPlacesTheWholeMap) {
  constexpr double kOffM = 7000.0;
  MapperParams params;
  params.navigation.start_at_first_fix = true;
  Embedding dive(params);
  PoseGraphOptimizer optimizer({});
  std::optional<PoseGraph> solution;
  const auto solve = [&] {
    while (static_cast<std::size_t>(optimizer.version()) < dive.steps.size())
      ASSERT_TRUE(optimizer.Add(dive.steps[static_cast<std::size_t>(optimizer.version())].update));
    solution = optimizer.Solve(SolveStart::kWarm);
    ASSERT_TRUE(solution);
    solution->graph_id = dive.mapper.graph().graph_id();
    ASSERT_TRUE(dive.mapper.Take(*solution));
  };
  for (int i = 0; i < 6; ++i) {
    dive.vehicle.sonar_on = true;
    dive.Drive(40.0);
    dive.vehicle.sonar_on = false;
    dive.Drive(560.0);
  }
  solve();
  dive.Drive(1.0);
  EXPECT_TRUE(SaysThatThePlaceIsUnknown(dive.mapper));
  EXPECT_GT(std::sqrt(dive.said->state.covariance(0, 0)), 900.0);
  dive.mapper.Add(dive.vehicle.Fix("gps", {kOffM, 0.0}));
  dive.Drive(1.0);
  EXPECT_FALSE(SaysThatThePlaceIsUnknown(dive.mapper));
  const auto said_off_m = [&] {
    const NavState& said = dive.said->state;
    return said.T_map_vehicle.translation().x() - dive.vehicle.TrueAt(said.time).translation().x();
  };
  EXPECT_NEAR(said_off_m(), kOffM, 3.0) << "before any solution has it";
  EXPECT_LT(std::sqrt(dive.said->state.covariance(0, 0)), 3.0);
  dive.vehicle.sonar_on = true;
  dive.Drive(60.0);
  dive.Finish();
  solve();
  dive.Drive(1.0);

  const auto true_m = [&](Time t) { return dive.vehicle.TrueAt(t).translation().x() + kOffM; };
  EXPECT_NEAR(dive.said->state.T_map_vehicle.translation().x(), true_m(dive.said->state.time), 3.0);
  EXPECT_LT(std::sqrt(dive.said->state.covariance(0, 0)), 30.0);
  ASSERT_GT(solution->vertices.size(), 6u);
  for (const SolvedVertex& vertex : solution->vertices)
    EXPECT_NEAR(vertex.T_map_level.x, true_m(dive.submaps.at(vertex.id)->frame_time), 15.0)
        << "5 km of dead reckoning";
}

}  // namespace
}  // namespace seastitch
