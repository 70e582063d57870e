#include "tests/mapper/mapper_node_fixtures.hpp"

namespace seastitch {
namespace {

TEST(MapperNode, UsesTheSolutionAndRefusesOneOfAnotherGraph) {
  Survey survey;
  survey.node->AddSubmap(ImportedSubmap(0, 0.0));
  survey.node->AddSubmap(ImportedSubmap(1, 60.0));
  survey.bus.HandleAll();
  PoseGraph graph;
  graph.graph_version = 2;
  graph.graph_id = survey.updates.front().graph_id;
  SolvedVertex vertex{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  graph.vertices = {vertex, vertex};
  graph.vertices[1].id = SubmapId{1};
  graph.vertices[1].T_map_level.x = 60.0;
  for (const pose_graph_t& part : ToLcm(graph, 1, FromUtime(0), 0)) {
    survey.bus.Publish("POSE_GRAPH", part);
  }
  survey.bus.HandleAll();
  EXPECT_EQ(survey.node->health().counter("solution_version"), 2);
  EXPECT_EQ(survey.node->health().counter("pose_graph_refused"), 0);
  graph.graph_version = 99;
  for (const pose_graph_t& part : ToLcm(graph, 2, FromUtime(0), 1)) {
    survey.bus.Publish("POSE_GRAPH", part);
  }
  survey.bus.HandleAll();
  EXPECT_EQ(survey.node->health().counter("pose_graph_refused"), 1);
  EXPECT_EQ(survey.node->health().counter("solution_version"), 2);
}

// A solution without loop closures: dead reckoning.
PoseGraph AsDeadReckoned(const std::vector<GraphUpdate>& updates) {
  PoseGraph graph;
  for (const GraphUpdate& update : updates) {
    graph.graph_version = update.version;
    graph.graph_id = update.graph_id;
    for (const GraphVertex& v : update.vertices)
      graph.vertices.push_back(
          {v.id, v.dead_reckoned, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()});
  }
  return graph;
}

// The submaps are correct; the solution displaces every second one by two metres.
TEST(MapperNode, WithholdsASolutionThatDoesHarmSaysSoAndGoesOnWithTheNextGoodOne) {
  Survey survey;
  for (int id = 0; id < 8; ++id) survey.node->AddSubmap(ImportedSubmap(id, 3.0 * id));
  survey.bus.HandleAll();
  const PoseGraph good = AsDeadReckoned(survey.updates);
  PoseGraph bad = good;
  for (std::size_t i = 1; i < bad.vertices.size(); i += 2) bad.vertices[i].T_map_level.y += 2.0;

  const health_t withheld = survey.Solve(bad);
  EXPECT_EQ(survey.node->health().counter("solutions_withheld"), 1);
  EXPECT_EQ(withheld.state, health_t::STATE_DEGRADED);
  EXPECT_NE(withheld.text.find("is withheld"), std::string::npos) << withheld.text;
  EXPECT_NE(withheld.text.find("less consistent"), std::string::npos) << withheld.text;
  EXPECT_FALSE(survey.node->LookAgain());  // nothing has moved
  // The solution is not requested again.
  EXPECT_EQ(survey.node->health().counter("solution_version"), 8);

  const health_t recovered = survey.Solve(good);
  EXPECT_EQ(survey.node->health().counter("solutions_withheld"), 1);
  EXPECT_EQ(recovered.text.find("withheld"), std::string::npos) << recovered.text;
  EXPECT_EQ(recovered.state, health_t::STATE_OK);
  EXPECT_TRUE(survey.node->LookAgain());
}

TEST(MapperNode, SaysThatASolutionTearsTheMapApartThoughTheDiskTakesNothing) {
  Survey survey;
  survey.BreakDisk();
  for (int id = 0; id < 8; ++id) survey.node->AddSubmap(ImportedSubmap(id, 3.0 * id));
  survey.bus.HandleAll();
  PoseGraph torn = AsDeadReckoned(survey.updates);
  for (std::size_t i = 0; i < torn.vertices.size(); ++i)
    torn.vertices[i].T_map_level.y += 500.0 * static_cast<double>(i);
  const health_t health = survey.Solve(torn);
  EXPECT_EQ(health.state, health_t::STATE_DEGRADED);
  EXPECT_NE(health.text.find("cannot be written"), std::string::npos) << health.text;
  EXPECT_NE(health.text.find("tear the map apart (0 cells"), std::string::npos) << health.text;
  EXPECT_EQ(health.text.find("less consistent"), std::string::npos) << health.text;
}

TEST(MapperNode, RegistersLaterWhatJoinedTheGraphUnregistered) {
  HeldWorker worker;
  Survey survey(&worker);
  constexpr int kSubmaps = 5;
  for (int id = 0; id < kSubmaps; ++id) survey.node->AddSubmap(ImportedSubmap(id, 2.0 * id));
  worker.RunAll();
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), kSubmaps);
  // two may wait, so that this one has only its dead-reckoning edge
  ASSERT_EQ(survey.updates[4].edges.size(), 1u);
  EXPECT_FALSE(survey.node->LookAgain()) << "no solution yet";
  for (const pose_graph_t& part : ToLcm(AsDeadReckoned(survey.updates), 1, FromUtime(0), 0))
    survey.bus.Publish("POSE_GRAPH", part);
  survey.bus.HandleAll();
  while (survey.node->LookAgain()) {
    survey.bus.HandleAll();
    worker.RunAll();
  }
  survey.bus.HandleAll();
  ASSERT_EQ(survey.requests.size(), 1u);
  EXPECT_EQ(survey.requests[0].sender, "mapper");
  EXPECT_EQ(survey.requests[0].graph_version, kSubmaps);
  std::map<std::pair<int, int>, std::set<double>> measured;  // a pair may be sent more than once
  for (const GraphUpdate& update : survey.updates)
    for (const GraphEdge& edge : update.edges)
      if (edge.kind == EdgeKind::kLoopClosure)
        measured[{edge.from.value, edge.to.value}].insert(edge.T_from_to.x);
  EXPECT_EQ(measured.size(), kSubmaps * (kSubmaps - 1) / 2);
  // Soundings without noise: pairs registered before this was estimated are registered again.
  for (const auto& [pair, places] : measured) EXPECT_LE(places.size(), 2u);
  EXPECT_EQ(survey.updates.back().version, static_cast<std::int64_t>(survey.updates.size()));
  EXPECT_TRUE(survey.updates.back().vertices.empty());
  EXPECT_FALSE(survey.node->LookAgain());
}

TEST(MapperNode, AsksAgainForCovariancesThatNeverCame) {
  Survey survey;
  survey.optimizer_answers = false;
  survey.Drive(1.0, kSpeedMps, 0.0);
  for (int id = 0; id < 3; ++id) survey.node->AddSubmap(ImportedSubmap(id, 500.0 * id));
  survey.bus.HandleAll();
  PoseGraph nearer = AsDeadReckoned(survey.updates);
  for (SolvedVertex& vertex : nearer.vertices) vertex.T_map_level.y = vertex.T_map_level.x = 0.0;
  survey.Solve(nearer);
  survey.Drive(20.0, kSpeedMps, 0.0);
  ASSERT_EQ(survey.requests.size(), 1u) << "one at a time";
  survey.Drive(20.0, kSpeedMps, 0.0);
  ASSERT_EQ(survey.requests.size(), 2u);
  EXPECT_EQ(survey.requests[1].pairs, survey.requests[0].pairs);
  EXPECT_NE(survey.requests[1].seq, survey.requests[0].seq);
  survey.optimizer_answers = true;
  survey.Drive(35.0, kSpeedMps, 0.0);
  ASSERT_EQ(survey.requests.size(), 3u);
  survey.Drive(60.0, kSpeedMps, 0.0);
  EXPECT_EQ(survey.requests.size(), 3u);
  EXPECT_GT(survey.node->health().counter("covariances_answered"), 0);
}

TEST(MapperNode, SendsAWholeGraphInOrderButNotAtOnce) {
  Survey survey;
  constexpr int kSubmaps = 40;
  for (int id = 0; id < kSubmaps; ++id) survey.node->AddSubmap(ImportedSubmap(id, 60.0 * id));
  survey.bus.HandleAll();
  survey.updates.clear();
  graph_request_t request{};
  request.sender = "optimizer";
  request.graph_id = survey.updates.front().graph_id;
  survey.bus.Publish("GRAPH_REQUEST", request);
  survey.bus.HandleAll();
  EXPECT_GE(survey.updates.size(), 1u);
  EXPECT_LT(survey.updates.size(), 20u);
  const std::size_t at_once = survey.updates.size();
  survey.node->SendWaiting();  // the sensors are off
  survey.bus.HandleAll();
  EXPECT_GT(survey.updates.size(), at_once);
  survey.node->AddSubmap(ImportedSubmap(kSubmaps, 60.0 * kSubmaps));
  survey.Drive(1.0, kSpeedMps, 0.0);
  ASSERT_EQ(survey.updates.size(), kSubmaps + 1);
  for (int i = 0; i <= kSubmaps; ++i)
    EXPECT_EQ(survey.updates[static_cast<std::size_t>(i)].version, i + 1);
}

TEST(MapperNode, KeepsItsSolutionWhileARestartedOptimizerCatchesUp) {
  Survey survey;
  for (int id = 0; id < 4; ++id) survey.node->AddSubmap(ImportedSubmap(id, 60.0 * id));
  survey.bus.HandleAll();
  const PoseGraph newest = AsDeadReckoned(survey.updates);
  survey.Solve(newest);
  survey.Solve(AsDeadReckoned({survey.updates[0], survey.updates[1]}));
  EXPECT_EQ(survey.node->health().counter("solution_version"), 4);
  EXPECT_EQ(survey.node->health().counter("pose_graph_older"), 1);
  survey.Solve(newest);
  EXPECT_EQ(survey.node->health().counter("pose_graph_older"), 1);
}

TEST(MapperNode, AsksForASolutionThatItLost) {
  Survey survey;
  std::vector<graph_request_t> requests;
  survey.bus.Subscribe<graph_request_t>(
      "GRAPH_REQUEST", 0, [&](const graph_request_t& m) { requests.push_back(m); });
  pose_graph_t part{};
  part.num_parts = 1;
  for (const std::int64_t seq : {0, 1, 5}) {
    part.seq = seq;
    survey.bus.Publish("POSE_GRAPH", part);
  }
  survey.bus.HandleAll();
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].sender, "mapper");
}

TEST(MapperNode, CountsMalformedMessagesAndGapsAndGoesOn) {
  Survey survey;
  survey.Drive(3.0, kSpeedMps, 0.0);
  imu_t imu{};
  imu.seq = 250;
  imu.angular_rate_radps[0] = std::numeric_limits<double>::quiet_NaN();
  survey.bus.Publish("IMU", imu);
  mbes_ping_t ping{};
  ping.sound_speed_mps = -1.0;
  survey.bus.Publish("MBES_PING", ping);
  covariances_t covariances{};
  covariances.recipient = "mapper";
  covariances.request_seq = -1;
  survey.bus.Publish("COVARIANCES", covariances);  // of a version that does not exist
  const char garbage[] = "not a message";
  for (const char* channel : {"IMU",
                              "DVL",
                              "DEPTH",
                              "MBES_PING",
                              "SVP",
                              "POSITION_FIX",
                              "POSE_GRAPH",
                              "GRAPH_REQUEST",
                              "COVARIANCES"}) {
    survey.bus.PublishBytes(channel, garbage, sizeof garbage);
  }
  survey.bus.HandleAll();
  const std::size_t navs = survey.navs.size();
  survey.Drive(3.0, kSpeedMps, 0.0);
  Health& health = survey.node->health();
  EXPECT_EQ(health.counter("imu_malformed"), 1);
  EXPECT_EQ(health.counter("imu_lost"), 250 - 150);
  EXPECT_EQ(health.counter("mbes_ping_malformed"), 1);
  EXPECT_EQ(health.counter("covariances_malformed"), 1);
  EXPECT_GE(survey.bus.decode_errors(), 9);
  EXPECT_GT(survey.navs.size(), navs + 20);
}

// Values that are not finite from the start: navigation never begins.
TEST(MapperNode, NamesMalformedMessagesFromTheStart) {
  Survey survey;
  for (int i = 0; i < 20; ++i) {
    imu_t imu{};
    imu.seq = i;
    imu.angular_rate_radps[0] = std::numeric_limits<double>::quiet_NaN();
    survey.bus.Publish("IMU", imu);
    health_t health{};
    health.process = "imu-driver";
    health.uptime_s = i;
    survey.bus.Publish("HEALTH", health);
    survey.bus.HandleAll();
  }
  const health_t now = survey.node->health().Snapshot(0, 1.0);
  EXPECT_EQ(now.state, health_t::STATE_DEGRADED);
  EXPECT_NE(now.text.find("cannot be used: 20 of imu"), std::string::npos) << now.text;
  survey.Drive(1.0, kSpeedMps, 0.0);
  health_t health{};
  health.process = "imu-driver";
  health.uptime_s = 30.0;
  survey.bus.Publish("HEALTH", health);
  survey.bus.HandleAll();
  EXPECT_EQ(survey.node->health().text().find("of imu"), std::string::npos) << "10 s later";
}

TEST(MapperNode, NamesSolutionsThatItCannotUse) {
  Survey survey;
  survey.PublishProfile();
  survey.Drive(1.0, kSpeedMps, 0.0);
  for (int id = 0; id < 3; ++id) survey.node->AddSubmap(ImportedSubmap(id, 60.0 * id));
  survey.bus.HandleAll();
  const PoseGraph good = AsDeadReckoned(survey.updates);
  PoseGraph of_another = good;
  of_another.graph_id += 1;
  EXPECT_NE(survey.Solve(of_another).text.find("it is of another graph"), std::string::npos);
  EXPECT_EQ(survey.Solve(good).text.find("cannot be used"), std::string::npos);
  PoseGraph newer = good;
  newer.graph_version = 99;
  EXPECT_NE(survey.Solve(newer).text.find("not of these submaps"), std::string::npos);
  pose_graph_t damaged = ToLcm(good, 50, FromUtime(0), 50).front();
  damaged.vertices.front().x_m = std::numeric_limits<double>::quiet_NaN();
  survey.bus.Publish("POSE_GRAPH", damaged);
  EXPECT_NE(survey.Solve(newer).text.find("not of these submaps"), std::string::npos);
  survey.bus.Publish("POSE_GRAPH", damaged);
  survey.bus.HandleAll();
  EXPECT_NE(survey.node->health().text().find("damaged or incomplete"), std::string::npos)
      << survey.node->health().text();
  EXPECT_EQ(survey.Solve(good).text.find("cannot be used"), std::string::npos);
}

// The optimizer on a bus of its own, so that messages can be lost on the way.
class WithOptimizer : public testing::Test {
 protected:
  WithOptimizer() {
    Forward(&survey_.bus, &bus_, {"GRAPH_UPDATE", "GRAPH_REQUEST"});
    Forward(&bus_, &survey_.bus, {"POSE_GRAPH"});
    for (int id = 0; id < 3; ++id) Add(id);
  }
  void Forward(Bus* from, Bus* to, const std::vector<std::string>& channels) {
    for (const std::string& channel : channels)
      from->SubscribeBytes(
          channel, 0, [this, to](const std::string& name, const void* data, int size) {
            if (name != lost_) to->PublishBytes(name, data, size);
          });
  }
  void Add(int id) {
    survey_.node->AddSubmap(ImportedSubmap(id, 60.0 * id));
    Handle();
  }
  void Handle() {
    for (int i = 0; i < 3; ++i) {
      survey_.bus.HandleAll();
      bus_.HandleAll();
    }
  }
  std::int64_t Solved() { return survey_.node->health().counter("solution_version"); }

  Survey survey_;
  Bus bus_{"memq://"};
  InlineWorker worker_;
  OptimizerNode optimizer_{{}, &bus_, &worker_};
  std::string lost_;  // channel whose messages are lost
};

TEST_F(WithOptimizer, TheLastUpdateIsSolvedThoughItWasLost) {
  EXPECT_EQ(Solved(), 3);
  lost_ = "GRAPH_UPDATE";
  Add(3);
  lost_ = "";
  EXPECT_EQ(Solved(), 3);
  survey_.node->RepeatNewest();
  Handle();
  EXPECT_EQ(Solved(), 3) << "it may still be at work";
  survey_.node->RepeatNewest();
  Handle();
  EXPECT_EQ(Solved(), 4);
  const std::size_t updates = survey_.updates.size();
  survey_.node->RepeatNewest();
  Handle();
  EXPECT_EQ(survey_.updates.size(), updates) << "all is solved";
}

TEST_F(WithOptimizer, TheLastSolutionComesThoughItWasLost) {
  lost_ = "POSE_GRAPH";
  Add(3);
  lost_ = "";
  EXPECT_EQ(Solved(), 3);
  survey_.node->RepeatNewest();
  survey_.node->RepeatNewest();
  Handle();
  EXPECT_EQ(Solved(), 4);
}

TEST(MapperNode, BoundsThePingsThatWaitForNavigation) {
  Survey survey;
  MbesPing ping;
  ping.time = survey.vehicle.time;
  ping.sound_speed_mps = kSoundMps;
  for (int i = 0; i < 1000; ++i) {
    ping.time += FromSeconds(0.1);
    survey.bus.Publish("MBES_PING", ToLcm(ping, {ping.time, i}));
    survey.bus.HandleAll();
  }
  EXPECT_EQ(survey.node->health().counter("pings_dropped_waiting"), 400);
}

TEST(MapperNode, IsNotHeldUpByAPingWithAStampFromTheFuture) {
  Survey survey;
  survey.Drive(5.0, kSpeedMps, 0.0);
  MbesPing ping;
  ping.time = survey.vehicle.time + FromSeconds(3600.0);
  ping.sound_speed_mps = kSoundMps;
  survey.bus.Publish("MBES_PING", ToLcm(ping, {survey.vehicle.time, 0}));
  survey.Drive(30.0, kSpeedMps, 0.0);
  survey.Finish();
  EXPECT_EQ(survey.node->health().counter("mbes_ping_of_another_sender"), 1)
      << "its number is out of the order, too";
  EXPECT_GE(survey.submaps.size(), 1u);
}

// Another vehicle's inertial unit on the same bus, at another place of its sequence.
TEST(MapperNode, KeepsToTheFirstOfTwoSendersAndNamesThem) {
  Survey survey;
  std::int64_t seq = 100'000;
  const auto drive = [&](double duration_s, bool other) {
    for (double t = 0.0; t < duration_s; t += 0.1) {
      survey.Drive(0.1, kSpeedMps, 0.0);
      if (!other) continue;
      for (int i = 0; i < 5; ++i) {
        ImuSample imu;
        imu.time = survey.vehicle.time + FromSeconds(0.001 * i);
        imu.angular_rate_radps = {0.0, 0.0, 0.5};
        imu.specific_force_mps2 = {0.0, 0.0, -9.805};
        survey.bus.Publish("IMU", ToLcm(imu, {imu.time, seq++}));
      }
    }
  };
  const auto says = [&] {
    const health_t health = survey.node->health().Snapshot(0, 1.0);
    return std::any_of(health.conditions.begin(), health.conditions.end(), [](const auto& c) {
      return c.name == conditions::kTwoSenders.name;
    });
  };
  drive(10.0, false);
  EXPECT_FALSE(says());
  drive(20.0, true);
  survey.bus.HandleAll();
  EXPECT_TRUE(says());
  EXPECT_EQ(survey.node->health().counter("imu_of_another_sender"), seq - 100'000);
  drive(30.0, false);
  survey.Finish();
  ASSERT_FALSE(survey.submaps.empty());
  EXPECT_EQ(survey.node->health().counter("imu_lost"), 0);
}

TEST(MapperNode, MakesNothingOfNothing) {
  Survey survey;
  survey.Finish();
  EXPECT_TRUE(survey.submaps.empty());
  EXPECT_TRUE(survey.updates.empty());
}

}  // namespace
}  // namespace seastitch
