#include "optimizer/optimizer_node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <fstream>
#include <limits>
#include <utility>

#include "common/runtime/config/config.hpp"
#include "optimizer/optimizer_config.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "tests/optimizer/survey_graph.hpp"
#include "tests/paths.hpp"

namespace seastitch {
namespace {

// The part of a mapper that the optimizer needs: keeps the graph, answers requests, collects
// solutions.
class MapperStub {
 public:
  MapperStub(const std::vector<GraphUpdate>& updates, Bus* bus) : updates_(updates), bus_(bus) {
    NameGraph(7);
    bus_->Subscribe<graph_request_t>("GRAPH_REQUEST", 16, [this](const graph_request_t& msg) {
      const bool is_of_another = msg.graph_id != 0 && msg.graph_id != graph_id;
      if (msg.sender != "optimizer" || is_of_another || silent) return;
      requests.push_back(msg.have_version);
      for (std::int64_t v = msg.have_version + 1; v <= published; ++v) Send(v);
    });
    bus_->Subscribe<pose_graph_t>("POSE_GRAPH", 0, [this](const pose_graph_t& msg) {
      utimes.push_back(msg.utime);
      if (auto solution = assembler_.Add(msg)) solutions.push_back(*solution);
    });
    bus_->Subscribe<covariances_t>(
        "COVARIANCES", 0, [this](const covariances_t& msg) { answers.push_back(*FromLcm(msg)); });
  }

  void Send(std::int64_t version) {
    const GraphUpdate& update = updates_[static_cast<std::size_t>(version - 1)];
    bus_->Publish("GRAPH_UPDATE", ToLcm(update, update.vertices[0].time, seq_++));
  }
  // Publishes the next update, or loses it.
  void PublishNext(bool lost = false) {
    ++published;
    if (!lost) Send(published);
    bus_->HandleAll();
  }
  void AskForCovariances(std::int64_t graph_version,
                         std::vector<std::pair<SubmapId, SubmapId>> pairs) {
    const CovarianceRequest request{"mapper", 4, graph_version, std::move(pairs), graph_id};
    bus_->Publish("COVARIANCE_REQUEST", ToLcm(request, FromUtime(0)));
    bus_->HandleAll();
  }
  void BeginAgain(const std::vector<GraphUpdate>& updates) {
    updates_ = updates;
    published = 0;
    NameGraph(graph_id + 1);
  }
  void AskForSolution(std::int64_t have_version) {
    graph_request_t msg{};
    msg.sender = "mapper";
    msg.graph_id = graph_id;
    msg.have_version = have_version;
    bus_->Publish("GRAPH_REQUEST", msg);
    bus_->HandleAll();
  }

  // The next update is the last one.
  void EndWithNext() { updates_[static_cast<std::size_t>(published)].final = true; }

  void NameGraph(std::int64_t id) {
    graph_id = id;
    for (GraphUpdate& update : updates_) update.graph_id = id;
  }

  std::int64_t graph_id = 0;
  bool silent = false;
  std::int64_t published = 0;
  std::vector<std::int64_t> requests;
  std::vector<std::int64_t> utimes;
  std::vector<PoseGraph> solutions;
  std::vector<PairCovariances> answers;

 private:
  std::vector<GraphUpdate> updates_;
  Bus* bus_;
  PoseGraphAssembler assembler_;
  std::int64_t seq_ = 0;
};

std::vector<GraphUpdate> SmallSurvey(unsigned seed = 3) {
  std::vector<GraphUpdate> updates =
      SimulateSurvey({.vertices = 12, .per_line = 4, .closures = 2, .seed = seed}).updates;
  for (GraphUpdate& update : updates) update.graph_id = 7;
  return updates;
}

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
