#include "tests/optimizer/optimizer_node_fixtures.hpp"

namespace seastitch {
namespace {

void ExpectSame(const PoseGraph& a, const PoseGraph& b) {
  EXPECT_EQ(a.graph_version, b.graph_version);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t k = 0; k < a.vertices.size(); ++k)
    EXPECT_LT((a.vertices[k].T_map_level.Vector() - b.vertices[k].T_map_level.Vector()).norm(),
              1e-6);
}

TEST(OptimizerNode, AnswersEveryUpdateWithASolution) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  ASSERT_EQ(mapper.solutions.size(), 12u);
  EXPECT_EQ(mapper.solutions.back().graph_version, 12);
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 12u);
  EXPECT_FALSE(mapper.solutions.back().loop_edges.empty());
  EXPECT_EQ(mapper.utimes.back(), ToUtime(SmallSurvey()[11].vertices[0].time));
  EXPECT_EQ(node.health().state(), HealthState::kOk);
  EXPECT_EQ(node.health().counter("vertices"), 12);
}

TEST(OptimizerNode, AsksOnStart) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  bus.HandleAll();
  EXPECT_EQ(mapper.requests, std::vector<std::int64_t>{0});
}

TEST(OptimizerNode, AsksForALostVersionAndGoesOn) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  for (int k = 0; k < 12; ++k) mapper.PublishNext(k == 4 || k == 5);
  EXPECT_EQ(mapper.requests, (std::vector<std::int64_t>{0, 4}));
  EXPECT_EQ(mapper.solutions.back().graph_version, 12);
  EXPECT_EQ(mapper.solutions.back().vertices.size(), 12u);
}

TEST(OptimizerNode, AsksAgainOnlyWhileSomethingIsMissing) {
  Bus bus("memq://");
  InlineWorker worker;
  std::vector<std::int64_t> asked;
  bus.Subscribe<graph_request_t>(
      "GRAPH_REQUEST", 16, [&](const graph_request_t& msg) { asked.push_back(msg.have_version); });
  OptimizerNode node({}, &bus, &worker);
  const auto updates = SmallSurvey();
  const auto send = [&](std::size_t k) {
    bus.Publish("GRAPH_UPDATE", ToLcm(updates[k], updates[k].vertices[0].time, 0));
    bus.HandleAll();
  };
  send(0);
  node.AskAgain();
  bus.HandleAll();
  EXPECT_EQ(asked, std::vector<std::int64_t>{0});
  send(2);
  send(2);  // contains nothing new
  EXPECT_EQ(asked, (std::vector<std::int64_t>{0, 1}));
  node.AskAgain();  // no answer came
  bus.HandleAll();
  EXPECT_EQ(asked, (std::vector<std::int64_t>{0, 1, 1}));
}

TEST(OptimizerNode, ARestartedOptimizerGetsEverythingAgain) {
  PoseGraph before;
  {
    Bus bus("memq://");
    InlineWorker worker;
    MapperStub mapper(SmallSurvey(), &bus);
    OptimizerNode first({}, &bus, &worker);
    for (int k = 0; k < 12; ++k) mapper.PublishNext();
    before = mapper.solutions.back();
  }
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  mapper.published = 12;
  OptimizerNode second({}, &bus, &worker);
  bus.HandleAll();
  ASSERT_FALSE(mapper.solutions.empty());
  ExpectSame(mapper.solutions.back(), before);
}

TEST(OptimizerNode, GivesAMapperThatAsksTheLastSolution) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.AskForSolution(0);
  EXPECT_TRUE(mapper.solutions.empty());
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  mapper.AskForSolution(12);
  ASSERT_EQ(mapper.solutions.size(), 12u);  // the optimizer has the graph
  mapper.AskForSolution(0);
  ASSERT_EQ(mapper.solutions.size(), 13u);
  ExpectSame(mapper.solutions[12], mapper.solutions[11]);
}

TEST(OptimizerNode, WhenAskedSolvesOnceForAllThatWait) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  node.SolveWaiting();
  node.EndStart();  // updates came since the last call: more may follow
  bus.HandleAll();
  EXPECT_TRUE(mapper.solutions.empty());
  node.EndStart();
  bus.HandleAll();
  ASSERT_EQ(mapper.solutions.size(), 1u);
  EXPECT_EQ(mapper.solutions[0].graph_version, 12);
}

// A worker that runs a job on command.
struct SlowWorker : Worker {
  std::deque<Job> jobs;
  int signs_of_life = 0;
  void ReportProgress() override { ++signs_of_life; }
  bool Post(Job job) override {
    jobs.push_back(std::move(job));
    return true;
  }
  std::size_t queue_depth() const override { return jobs.size(); }
  void Run() {
    const Job job = std::move(jobs.front());
    jobs.pop_front();
    job()();
  }
};

TEST(OptimizerNode, ASolutionInTheMakingGivesSignsOfLife) {
  Bus bus("memq://");
  SlowWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.PublishNext();
  EXPECT_EQ(worker.signs_of_life, 0);
  worker.Run();
  mapper.PublishNext();
  worker.Run();
  EXPECT_GT(worker.signs_of_life, 0);
}

TEST(OptimizerNode, AFloodWhileTheWorkerSolvesIsBoundedAndAskedForAgain) {
  Bus bus("memq://");
  SlowWorker worker;
  OptimizerNode node({}, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
  std::vector<std::int64_t> asked;
  bus.Subscribe<graph_request_t>(
      "GRAPH_REQUEST", 0, [&](const graph_request_t& msg) { asked.push_back(msg.have_version); });
  const auto send = [&](std::int64_t version) {
    graph_update_t msg{};
    msg.version = version;
    bus.Publish("GRAPH_UPDATE", msg);
    bus.HandleAll();
  };
  node.EndStart();
  send(1);
  node.SolveWaiting();
  for (std::int64_t version = 2; version <= 1003; ++version) send(version);
  EXPECT_EQ(node.health().counter("updates_dropped_busy"), 2);
  worker.Run();
  EXPECT_EQ(worker.queue_depth(), 0u) << "what is known to be incomplete is not solved";
  node.AskAgain();
  bus.HandleAll();
  ASSERT_FALSE(asked.empty());
  EXPECT_EQ(asked.back(), 1001);
}

TEST(OptimizerNode, AnswersRequestsAndKeepsUpdatesWhileTheWorkerSolves) {
  Bus bus("memq://");
  SlowWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
  node.EndStart();
  const auto next = [&] {
    mapper.PublishNext();
    node.SolveWaiting();
  };
  next();
  next();
  next();
  EXPECT_EQ(worker.queue_depth(), 1u);
  worker.Run();
  bus.HandleAll();
  ASSERT_EQ(mapper.solutions.size(), 1u);
  EXPECT_EQ(mapper.solutions[0].graph_version, 1);
  EXPECT_EQ(worker.queue_depth(), 1u);  // for the first of the updates that waited
  mapper.AskForSolution(0);
  EXPECT_EQ(mapper.solutions.size(), 2u);
  worker.Run();
  bus.HandleAll();
  ASSERT_EQ(mapper.solutions.size(), 3u);
  EXPECT_EQ(mapper.solutions[2].graph_version, 2);
  worker.Run();
  bus.HandleAll();
  ASSERT_EQ(mapper.solutions.size(), 4u);
  EXPECT_EQ(mapper.solutions[3].graph_version, 3);
}

// As a replay does; behind by many, it solves once for all but the last of them.
TEST(OptimizerNode, LiveSolvesEachUpdateInTurnUnlessManyWait) {
  constexpr int kVersions = 40;
  Bus bus("memq://");
  SlowWorker worker;
  MapperStub mapper(
      SimulateSurvey({.vertices = kVersions, .per_line = 10, .closures = 2, .seed = 3}).updates,
      &bus);
  OptimizerNode node({}, &bus, &worker, OptimizerNode::SolveOn::kWhenAsked);
  node.EndStart();
  for (int k = 0; k < kVersions; ++k) mapper.PublishNext();
  while (worker.queue_depth() > 0) {
    worker.Run();
    bus.HandleAll();
  }
  std::vector<std::int64_t> versions, expected{1};
  for (const PoseGraph& solution : mapper.solutions) versions.push_back(solution.graph_version);
  for (int version = kVersions - 15; version <= kVersions; ++version) expected.push_back(version);
  EXPECT_EQ(versions, expected);
}

TEST(OptimizerNode, SaysHowWellTwoSubmapsAreKnownToEachOther) {
  Bus bus("memq://");
  InlineWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.AskForCovariances(1, {{SubmapId{0}, SubmapId{1}}});
  EXPECT_TRUE(mapper.answers.empty()) << "no solution yet";
  for (int k = 0; k < 12; ++k) mapper.PublishNext();
  mapper.AskForCovariances(11, {{SubmapId{2}, SubmapId{5}}});
  EXPECT_TRUE(mapper.answers.empty()) << "another solution came since";
  EXPECT_EQ(node.health().counter("covariance_requests_late"), 2);
  mapper.AskForCovariances(0, {});
  EXPECT_EQ(node.health().counter("covariance_requests_malformed"), 1);
  mapper.AskForCovariances(12, {{SubmapId{2}, SubmapId{5}}, {SubmapId{2}, SubmapId{99}}});
  ASSERT_EQ(mapper.answers.size(), 1u);
  EXPECT_EQ(mapper.answers[0].recipient, "mapper");
  EXPECT_EQ(mapper.answers[0].request_seq, 4);
  EXPECT_EQ(mapper.answers[0].graph_version, 12);
  ASSERT_EQ(mapper.answers[0].pairs.size(), 1u);
  EXPECT_EQ(mapper.answers[0].pairs[0].b, SubmapId{5});
  EXPECT_GT(mapper.answers[0].pairs[0].covariance(0, 0), 0.0);
  EXPECT_EQ(node.health().counter("pair_covariances"), 1);
}

TEST(OptimizerNode, TakesUpdatesThatCameWhileItLookedForCovariances) {
  Bus bus("memq://");
  SlowWorker worker;
  MapperStub mapper(SmallSurvey(), &bus);
  OptimizerNode node({}, &bus, &worker);
  mapper.PublishNext();
  worker.Run();
  bus.HandleAll();
  mapper.AskForCovariances(1, {{SubmapId{0}, SubmapId{1}}});
  mapper.PublishNext();
  mapper.AskForCovariances(1, {{SubmapId{0}, SubmapId{1}}});
  EXPECT_EQ(worker.queue_depth(), 1u) << "one job at a time";
  worker.Run();
  bus.HandleAll();
  EXPECT_EQ(mapper.answers.size(), 1u);
  EXPECT_EQ(worker.queue_depth(), 1u);
  worker.Run();
  bus.HandleAll();
  EXPECT_EQ(mapper.solutions.back().graph_version, 2);
}

}  // namespace
}  // namespace seastitch
