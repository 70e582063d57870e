#include "tests/optimizer/optimizer_node_fixtures.hpp"

namespace seastitch {
namespace {

TEST(OptimizerNode, BeginsAgainWhenTheMapperHasAnotherGraph) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(3), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  mapper.BeginAgain(SmallSurvey(4));
  for (int k = 0; k < 3; ++k) mapper.PublishNext();
  EXPECT_EQ(mapper.solutions.back().graph_version, 3);
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 3u);
  EXPECT_EQ(node.health().counter("graphs_started_over"), 1);
  EXPECT_EQ(mapper.solutions.back().graph_id, 8);

  GraphUpdate late = SmallSurvey(3)[11];
  late.graph_id = 7;
  bus.Publish("GRAPH_UPDATE", ToLcm(late, late.vertices[0].time, 0));
  mapper.PublishNext();
  EXPECT_EQ(mapper.solutions.back().graph_version, 4);
  EXPECT_EQ(node.health().counter("graphs_started_over"), 1)
      << "a late update of the mapper before";
  EXPECT_EQ(node.health().counter("updates_of_another_graph"), 1);
}

// --- two mappers on one bus ----------------------------------------------------------------------

class TwoMappers : public ::testing::Test {
 protected:
  TwoMappers() : node({}, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked) {
    node.EndStart();
    for (int k = 0; k < 5; ++k) first.PublishNext();
    other.NameGraph(99);
    node.SolveWaiting();
  }
  bool Says(const ConditionKind& kind) {
    const health_t health = node.health().Snapshot(0, 1.0);
    return std::any_of(health.conditions.begin(), health.conditions.end(), [&](const auto& c) {
      return c.name == kind.name;
    });
  }

  Bus bus{"memq://"};
  InlineWorker worker;
  MapperStub first{SmallSurvey(), &bus};
  MapperStub other{SmallSurvey(4), &bus};
  OptimizerNode node;
};

TEST_F(TwoMappers, TheFirstIsServedWhileItLives) {
  for (int k = 0; k < 6; ++k) {
    other.PublishNext();
    node.AskAgain();
    bus.HandleAll();
  }
  EXPECT_TRUE(Says(conditions::kTwoMappers));
  first.PublishNext();
  node.SolveWaiting();
  bus.HandleAll();
  EXPECT_EQ(first.solutions.back().graph_id, first.graph_id);
  EXPECT_EQ(first.solutions.back().graph_version, 6);
  EXPECT_EQ(node.health().counter("graphs_started_over"), 0);
  // The second one ends.
  for (int k = 0; k < 6; ++k) node.AskAgain();
  EXPECT_FALSE(Says(conditions::kTwoMappers));
}

TEST_F(TwoMappers, TheSecondIsTakenUpWhenTheFirstIsSilent) {
  first.silent = true;
  other.PublishNext();
  other.PublishNext();
  node.AskAgain();
  bus.HandleAll();
  EXPECT_EQ(node.health().counter("graphs_started_over"), 0);
  node.AskAgain();
  bus.HandleAll();
  EXPECT_EQ(node.health().counter("graphs_started_over"), 1);
  other.PublishNext();
  node.SolveWaiting();
  bus.HandleAll();
  EXPECT_EQ(other.solutions.back().graph_id, 99);
  EXPECT_EQ(other.solutions.back().graph_version, 3) << "whatever version came first";
  EXPECT_FALSE(Says(conditions::kTwoMappers));
}

// Such as by a mapper that begins a new map after its last.
TEST_F(TwoMappers, TheSecondIsTakenUpAtOnceWhenTheFirstHasEnded) {
  first.EndWithNext();
  first.PublishNext();
  node.SolveWaiting();
  first.silent = true;
  other.PublishNext();
  other.PublishNext();
  node.SolveWaiting();
  bus.HandleAll();
  EXPECT_EQ(node.health().counter("graphs_started_over"), 1);
  EXPECT_EQ(other.solutions.back().graph_id, 99);
  EXPECT_EQ(other.solutions.back().graph_version, 2);
  EXPECT_FALSE(Says(conditions::kTwoMappers));
}

TEST(OptimizerNode, AMapperOfAnotherGraphIsGivenTheSolutionWhateverVersionItHad) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 3; ++k) mapper.PublishNext();
  mapper.AskForSolution(3);
  EXPECT_EQ(mapper.solutions.size(), 3u);
  mapper.graph_id = 6;
  mapper.AskForSolution(5);
  EXPECT_EQ(mapper.solutions.size(), 4u);
}

TEST(OptimizerNode, OfAMalformedUpdateTheSubmapAndTheGoodEdgesAreTaken) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 5; ++k) mapper.PublishNext();
  const GraphUpdate sixth = SmallSurvey()[5];
  ASSERT_EQ(sixth.edges.size(), 3u);
  auto bad = ToLcm(sixth, sixth.vertices[0].time, 0);
  bad.edges[1].x_m = std::numeric_limits<double>::quiet_NaN();
  bus.Publish("GRAPH_UPDATE", bad);
  bad.version = -5;
  bus.Publish("GRAPH_UPDATE", bad);
  bus.HandleAll();
  EXPECT_EQ(node.health().counter("updates_malformed"), 2);
  EXPECT_EQ(mapper.solutions.back().graph_version, 6);
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 6u);
  EXPECT_EQ(mapper.solutions.back().loop_edges.size(), mapper.solutions[4].loop_edges.size() + 1);
  EXPECT_EQ(node.health().state(), HealthState::kOk);
}

TEST(OptimizerNode, AnUpdateOfTooManyEdgesLosesNoSubmap) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 5; ++k) mapper.PublishNext();
  const GraphUpdate sixth = SmallSurvey()[5];
  auto large = ToLcm(sixth, sixth.vertices[0].time, 0);
  large.edges.resize(300, large.edges.back());
  large.num_edges = 300;
  bus.Publish("GRAPH_UPDATE", large);
  bus.HandleAll();
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 6u);
  EXPECT_EQ(mapper.solutions.back().loop_edges.size(), mapper.solutions[4].loop_edges.size() + 2);
}

// The update is requested again. If it is malformed again, the graph continues without it, and
// HEALTH reports it.
TEST(OptimizerNode, AMalformedSubmapIsAskedForAgainAndDegradesWhileItIsMissing) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.PublishNext();
  auto bad = ToLcm(SmallSurvey()[1], SmallSurvey()[1].vertices[0].time, 0);
  bad.vertices[0].dead_reckoned_x_m = std::numeric_limits<double>::quiet_NaN();
  for (const bool better : {true, false}) {
    const std::size_t asked = mapper.requests.size();
    bus.Publish("GRAPH_UPDATE", bad);
    bus.HandleAll();
    EXPECT_EQ(mapper.requests.size(), asked + 1);
    EXPECT_EQ(node.health().state(), HealthState::kDegraded);
    if (better) {
      mapper.PublishNext();
      EXPECT_EQ(mapper.solutions.back().vertices.size(), 2u);
      EXPECT_EQ(node.health().state(), HealthState::kOk);
      bad = ToLcm(SmallSurvey()[2], SmallSurvey()[2].vertices[0].time, 0);
      bad.vertices[0].dead_reckoned_x_m = std::numeric_limits<double>::quiet_NaN();
    }
  }
  bus.Publish("GRAPH_UPDATE", bad);
  bus.HandleAll();
  mapper.published = 3;
  mapper.PublishNext();
  EXPECT_EQ(mapper.solutions.back().graph_version, 4);
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 3u);
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
}

TEST(OptimizerNode, AVersionThatNeverComesDegradesForAWhileOnly) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.PublishNext();
  graph_update_t far = ToLcm(SmallSurvey()[1], SmallSurvey()[1].vertices[0].time, 0);
  far.graph_id = 7;
  far.version = 1'000'000'000'000;
  bus.Publish("GRAPH_UPDATE", far);
  bus.HandleAll();
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
  for (int k = 0; k < 4; ++k) {
    node.AskAgain();
    bus.HandleAll();
    mapper.PublishNext();  // the dive continues between the ticks
  }
  EXPECT_EQ(node.health().state(), HealthState::kOk);
  EXPECT_EQ(node.health().counter("versions_given_up"), 1);
  mapper.PublishNext(true);
  mapper.PublishNext();  // a gap is handled as before
  EXPECT_EQ(mapper.solutions.back().graph_version, 7);
}

TEST(OptimizerNode, SolvesNothingBeforeItHasCaughtUp) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.PublishNext();
  for (int k = 0; k < 10; ++k) mapper.PublishNext(true);
  mapper.PublishNext();
  ASSERT_EQ(mapper.solutions.size(), 2u);
  EXPECT_EQ(mapper.solutions.back().graph_version, 12);
}

TEST(OptimizerNode, SaysWhereASolutionDidNotConverge) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({.max_iterations = 1}, &bus, &worker);
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  EXPECT_EQ(mapper.solutions.size(), 12u);
  EXPECT_GT(node.health().counter("solves_not_converged"), 0);
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
}

TEST(OptimizerNode, SaysWhereASolutionHasNoCovariance) {
  Bus bus("memq://");
  InlineWorker worker;
  std::vector<GraphUpdate> updates;
  Pose2 pose{100.0, 50.0, 0.3};
  for (int k = 0; k < 5; ++k) {
    updates.push_back({k + 1, {{SubmapId{k}, Time(Duration(k + 1)), pose}}, {}});
    const Pose2 step{10.0, 0.0, Deg2Rad(92.0)};
    pose = pose * step;
    if (k == 0 || k == 3) continue;  // a link of 1e12 m between steps of 0.1 mm
    GraphEdge edge{EdgeKind::kDeadReckoning, SubmapId{k - 1}, SubmapId{k}, step};
    edge.information = DiagonalInformation(1e-4, 1e-4);
    updates.back().edges = {edge};
  }
  MapperStub mapper(updates, &bus);
  OptimizerNode node({.unlinked_sigma_m = 1e12}, &bus, &worker);
  for (int k = 0; k < 5; ++k) mapper.PublishNext();
  EXPECT_GT(node.health().counter("covariance_failed"), 0);
  EXPECT_EQ(node.health().state(), HealthState::kDegraded);
}

TEST(OptimizerConfig, ShippedFileIsTheDefaults) {
  const OptimizerParams params = LoadOptimizerConfig(ConfigFile("optimizer.yaml"));
  const OptimizerParams defaults;
  EXPECT_EQ(params.inlier_probability, defaults.inlier_probability);
  EXPECT_EQ(params.graduation_step, defaults.graduation_step);
  EXPECT_EQ(params.max_iterations, defaults.max_iterations);
  EXPECT_EQ(params.unlinked_sigma_m, defaults.unlinked_sigma_m);
  EXPECT_NEAR(params.unlinked_sigma_yaw_rad, defaults.unlinked_sigma_yaw_rad, 1e-12);
}

class BadConfig : public ::testing::Test {
 protected:
  std::string Error(const std::string& yaml) {
    const std::string path = ::testing::TempDir() + "optimizer_bad.yaml";
    std::ofstream(path) << yaml;
    try {
      LoadOptimizerConfig(path);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return {};
  }
};

TEST_F(BadConfig, NamesKeyAndValue) {
  EXPECT_NE(Error("graduation_stepp: 2\n").find("graduation_stepp: unknown key"),
            std::string::npos);
  EXPECT_NE(Error("unlinked_sigma_m: -1\n").find("unlinked_sigma_m: '-1' is not a number above 0"),
            std::string::npos);
  EXPECT_NE(Error("unlinked_sigma_m: far\n").find("unlinked_sigma_m: 'far'"), std::string::npos);
}

}  // namespace
}  // namespace seastitch
