#include "mapper/mapper_node.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "optimizer/optimizer_node.hpp"
#include "seastitch/health_t.hpp"
#include "tests/mapper/perfect_vehicle.hpp"
#include "tests/runtime/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kSpeedMps = 1.5;
constexpr double kSoundMps = PerfectVehicle::kSoundMps;

// A worker that keeps jobs until RunAll(), as a busy thread would.
class HeldWorker : public Worker {
 public:
  bool Post(Job job) override {
    jobs_.push_back(std::move(job));
    return true;
  }
  std::size_t queue_depth() const override { return jobs_.size(); }
  void RunAll() {
    while (!jobs_.empty()) {
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      job()();
    }
  }

 private:
  std::deque<Job> jobs_;
};

// A vehicle with perfect sensors, except for its compass if requested. Its messages go to a mapper
// on a separate bus.
class Survey {
 public:
  explicit Survey(Worker* worker = nullptr, const NavigationParams& navigation = {})
      : dir_(MakeDir()) {
    MapperConfig config;
    config.navigation = navigation;
    config.map_dir = dir_;
    config.max_waiting_submaps = 2;
    node = std::make_unique<MapperNode>(config, &bus, worker == nullptr ? &inline_ : worker);
    bus.Subscribe<nav_t>("NAV", 0, [this](const nav_t& m) { navs.push_back(m); });
    bus.Subscribe<graph_update_t>("GRAPH_UPDATE", 0, [this](const graph_update_t& m) {
      if (auto update = FromLcm(m)) updates.push_back(*update);
    });
    bus.Subscribe<submap_t>("SUBMAP", 0, [this](const submap_t& m) { assembler_.Add(m); });
    bus.Subscribe<submap_points_t>("SUBMAP_POINTS", 0, [this](const submap_points_t& m) {
      if (auto submap = assembler_.Add(m)) submaps.push_back(*submap);
    });
    // Answers like an optimizer with relative sigmas of 1 m and 1 rad.
    bus.Subscribe<covariance_request_t>(
        "COVARIANCE_REQUEST", 0, [this](const covariance_request_t& m) {
          requests.push_back(*FromLcm(m));
          if (!optimizer_answers) return;
          PairCovariances answer{m.sender, m.seq, m.graph_version, {}, m.graph_id};
          for (const auto& [a, b] : requests.back().pairs)
            answer.pairs.push_back({a, b, Eigen::Matrix3d::Identity()});
          bus.Publish("COVARIANCES", ToLcm(answer, FromUtime(m.utime), m.seq));
        });
    bus.SubscribeBytes(".*", 0, [this](const std::string& channel, const void* data, int size) {
      if (channel == "NAV" || channel.starts_with("SUBMAP") || channel == "GRAPH_UPDATE")
        out +=
            channel + std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
    });
  }
  ~Survey() { fs::remove_all(dir_); }

  void PublishProfile() {
    SoundVelocityProfile profile{vehicle.time, {0.0, 100.0}, {kSoundMps, kSoundMps}};
    bus.Publish("SVP", ToLcm(profile, {vehicle.time, 0}));
    bus.HandleAll();
  }
  // Two lines of opposite course, 15 m apart, with the turn between them.
  void TwoLines(double length_m) {
    // no jump in speed that the IMU did not measure
    Drive(2.0 + length_m / kSpeedMps, kSpeedMps, 0.0);
    const double turn_s = kPi * 7.5 / kSpeedMps;
    Drive(turn_s, kSpeedMps, kPi / turn_s);
    Drive(length_m / kSpeedMps, kSpeedMps, 0.0);
  }
  void Drive(double duration_s, double speed_mps, double yaw_rate_radps) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle.Step(speed_mps, yaw_rate_radps))
        std::visit([this](const auto& s) { Send(s); }, sample);
      bus.HandleAll();
    }
  }
  void Finish() {
    node->Finish();
    bus.HandleAll();
  }
  // Health after a solution.
  health_t Solve(const PoseGraph& graph) {
    for (const pose_graph_t& part : ToLcm(graph, solutions_ + 1, FromUtime(0), solutions_))
      bus.Publish("POSE_GRAPH", part);
    ++solutions_;
    bus.HandleAll();
    return node->health().Snapshot(0, 1.0);
  }
  // Puts a file at the place of the survey directory: every write fails.
  void BreakDisk() {
    fs::remove_all(dir_);
    std::ofstream(dir_) << "in the way";
  }

  Bus bus{"memq://"};
  std::unique_ptr<MapperNode> node;
  PerfectVehicle vehicle;
  std::vector<nav_t> navs;
  std::vector<GraphUpdate> updates;
  std::vector<CovarianceRequest> requests;
  bool optimizer_answers = true;
  std::vector<Submap> submaps;
  std::string out;  // all bytes sent

 private:
  static fs::path MakeDir() {
    static int number = 0;
    return fs::path(testing::TempDir()) /
           ("seastitch_mapper_" + std::to_string(::getpid()) + "_" + std::to_string(number++));
  }

  void Send(const ImuSample& s) { bus.Publish("IMU", ToLcm(s, {s.time, imu_seq_++})); }
  void Send(const DvlSample& s) { bus.Publish("DVL", ToLcm(s, {s.time, dvl_seq_++})); }
  void Send(const DepthSample& s) { bus.Publish("DEPTH", ToLcm(s, {s.time, depth_seq_++})); }
  void Send(const MbesPing& s) { bus.Publish("MBES_PING", ToLcm(s, {s.time, ping_seq_++})); }

  InlineWorker inline_;
  fs::path dir_;
  SubmapAssembler assembler_;
  std::int64_t imu_seq_ = 0;
  std::int64_t dvl_seq_ = 0;
  std::int64_t depth_seq_ = 0;
  std::int64_t ping_seq_ = 0;
  std::int64_t solutions_ = 0;
};

std::vector<GraphEdge> EdgesOnOne(const std::vector<GraphUpdate>& updates, EdgeKind kind) {
  std::vector<GraphEdge> edges;
  for (const GraphUpdate& update : updates)
    for (const GraphEdge& edge : update.edges)
      if (edge.kind == kind && edge.from == edge.to) edges.push_back(edge);
  return edges;
}

TEST(MapperNode, TellsTheGraphOfItsStartAndOfEveryFixOnce) {
  Survey survey;
  survey.PublishProfile();
  for (int n = 0; n < 6; ++n) {
    survey.Drive(20.0, kSpeedMps, 0.0);
    PositionFix fix;
    fix.time = survey.vehicle.time;
    fix.latitude_rad = 1e-6 * n;
    survey.bus.Publish("POSITION_FIX", ToLcm(fix, {survey.vehicle.time, n}));
    fix.time += FromSeconds(1.0);  // so soon after the last one that it adds little
    survey.bus.Publish("POSITION_FIX", ToLcm(fix, {survey.vehicle.time, n}));
  }
  survey.bus.HandleAll();  // the last fix is later than the last ping
  survey.Finish();
  const auto starts = EdgesOnOne(survey.updates, EdgeKind::kDeadReckoning);
  ASSERT_EQ(starts.size(), 1u);
  EXPECT_EQ(starts[0].from, survey.updates[0].vertices[0].id);
  const auto fixes = EdgesOnOne(survey.updates, EdgeKind::kPositionFix);
  ASSERT_EQ(fixes.size(), 6u);
  EXPECT_EQ(survey.node->health().counter("position_fixes_in_graph"), 6);
  for (std::size_t n = 0; n < fixes.size(); ++n) {
    // Each fix is on the submap nearest in time, in an update that has that submap.
    const double t_s = 20.0 * static_cast<double>(n + 1);
    SubmapId nearest;
    double apart_s = 1e9;
    for (const Submap& submap : survey.submaps) {
      const double s =
          std::abs(ToSeconds(submap.frame_time - FromUtime(1'700'000'000'000'000)) - t_s);
      if (s < apart_s) {
        apart_s = s;
        nearest = submap.id;
      }
    }
    EXPECT_EQ(fixes[n].from, nearest) << n;
  }
}

TEST(MapperNode, MapsTwoLinesAndClosesTheLoopBetweenThem) {
  Survey survey;
  survey.PublishProfile();
  survey.TwoLines(60.0);
  survey.Finish();

  ASSERT_GE(survey.submaps.size(), 3u);
  double worst_m = 0.0;
  for (const Submap& submap : survey.submaps) {
    EXPECT_GE(submap.footprint.size(), 3u);
    for (const Eigen::Vector3f& p : submap.cloud.points) {
      const Eigen::Vector3d p_map = submap.T_map_submap * p.cast<double>();
      worst_m =
          std::max(worst_m, std::abs(p_map.z() - PerfectVehicle::Seabed(p_map.x(), p_map.y())));
    }
  }
  EXPECT_LT(worst_m, 0.4);

  ASSERT_EQ(survey.updates.size(), survey.submaps.size());
  EXPECT_TRUE(survey.updates.back().final);
  std::set<std::pair<SubmapId, SubmapId>> accepted;  // some are sent more than once
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const GraphUpdate& update = survey.updates[i];
    EXPECT_EQ(update.version, static_cast<std::int64_t>(i) + 1);
    ASSERT_EQ(update.vertices.size(), 1u);
    EXPECT_EQ(update.vertices[0].id, survey.submaps[i].id);
    EXPECT_GT(update.vertices[0].heading_sigma_rad.value(), 1e-4);
    if (i > 0) {
      ASSERT_FALSE(update.edges.empty());
      EXPECT_EQ(update.edges[0].kind, EdgeKind::kDeadReckoning);
      EXPECT_GT(update.edges[0].information(0, 0), 1.0);
    }
    for (const GraphEdge& edge : update.edges) {
      if (edge.kind != EdgeKind::kLoopClosure || edge.verdict != LoopVerdict::kAccepted) continue;
      accepted.emplace(edge.from, edge.to);
      const auto level = [&](SubmapId id) {
        return LevelPose(survey.submaps[static_cast<std::size_t>(id.value)].T_map_submap);
      };
      const Pose2 expected = Inverse(level(edge.from)) * level(edge.to);
      EXPECT_LT((expected.Translation() - edge.T_from_to.Translation()).norm(), 0.3);
    }
  }
  EXPECT_GE(accepted.size(), 1u);
  EXPECT_EQ(survey.node->health().counter("loop_closures_accepted"),
            static_cast<std::int64_t>(accepted.size()));
  EXPECT_EQ(survey.node->health().counter("store_saved"),
            static_cast<std::int64_t>(survey.submaps.size()));
  EXPECT_EQ(survey.node->health().counter("pings_without_profile"), 0);
  EXPECT_EQ(survey.node->health().state(), HealthState::kOk) << survey.node->health().text();
  EXPECT_NE(survey.node->health().text().find("0.0 % of soundings rejected"), std::string::npos)
      << survey.node->health().text();
}

// The published heading follows half of the compass error; the submap does not.
TEST(MapperNode, DoesNotBendASubmapWhereTheCompassWanders) {
  NavigationParams navigation;
  navigation.gyro_bias_radps.sigma = 1e-6;
  navigation.gyro_noise_radps_rthz = 1e-5;
  navigation.attitude_heading_wander_rad = {Deg2Rad(2.0), 60.0};
  Survey survey(nullptr, navigation);
  survey.PublishProfile();
  survey.Drive(20.0, kSpeedMps, 0.0);
  survey.vehicle.compass_rate_radps = Deg2Rad(6.0) / 20.0;
  survey.Drive(20.0, kSpeedMps, 0.0);
  survey.Finish();
  ASSERT_FALSE(survey.submaps.empty());
  double squares = 0.0;
  double points = 0.0;
  for (const Submap& submap : survey.submaps) {
    const Eigen::Isometry3d T_map_submap = survey.vehicle.TrueAt(submap.frame_time);
    for (const Eigen::Vector3f& p : submap.cloud.points) {
      const Eigen::Vector3d p_map = T_map_submap * p.cast<double>();
      squares += std::pow(p_map.z() - PerfectVehicle::Seabed(p_map.x(), p_map.y()), 2);
      points += 1.0;
    }
  }
  EXPECT_LT(std::sqrt(squares / points), 0.02);  // bent: 0.066
}

TEST(MapperNode, SaysWhyItsDirectoryCannotBeMade) {
  const TemporaryDir dir;
  MapperConfig config;
  config.map_dir = dir.Write("file", "in the way") + "/survey";
  Bus bus("memq://");
  InlineWorker worker;
  try {
    const MapperNode node(config, &bus, &worker);
    FAIL() << "a file cannot be a directory";
  } catch (const std::runtime_error& e) {
    EXPECT_EQ(std::string(e.what()),
              config.map_dir.string() + ": cannot be made a directory: Not a directory");
  }
}

TEST(MapperNode, PublishesNavAtItsRateByTheTimeOfTheMessages) {
  Survey survey;
  survey.Drive(20.0, kSpeedMps, 0.0);
  ASSERT_GT(survey.navs.size(), 150u);
  EXPECT_LE(survey.navs.size(), 201u);
  for (std::size_t i = 1; i < survey.navs.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(survey.navs[i].utime - survey.navs[i - 1].utime), 1e5, 1e3);
  }
}

TEST(MapperNode, GivesTheSameBytesTwice) {
  Survey a;
  Survey b;
  for (Survey* survey : {&a, &b}) {
    survey->TwoLines(32.0);
    survey->Finish();
  }
  EXPECT_GT(a.out.size(), 100'000u);
  EXPECT_TRUE(a.out == b.out);
}

TEST(MapperNode, SaysWhereItsSoundSpeedComesFrom) {
  Survey survey;
  survey.Drive(20.0, kSpeedMps, 0.0);
  survey.Finish();
  EXPECT_GT(survey.node->health().counter("pings_without_profile"), 0);
  EXPECT_EQ(survey.node->health().state(), HealthState::kDegraded);
  EXPECT_NE(survey.node->health().text().find("no sound-speed profile is known"),
            std::string::npos);
}

TEST(MapperNode, RepeatsGraphVersionsOnRequest) {
  Survey survey;
  for (int id = 0; id < 4; ++id) survey.node->AddSubmap(ImportedSubmap(id, 60.0 * id));
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), 4u);
  graph_request_t request{};
  request.sender = "optimizer";
  request.graph_id = survey.updates.front().graph_id;
  request.have_version = 2;
  survey.bus.Publish("GRAPH_REQUEST", request);
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), 6u);
  EXPECT_EQ(survey.updates[4].version, 3);
  EXPECT_EQ(survey.updates[5].version, 4);
  graph_request_t of_another = request;
  of_another.graph_id += 1;
  of_another.have_version = 4;
  survey.bus.Publish("GRAPH_REQUEST", of_another);
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), 6u) << "a request to another mapper";
  of_another.graph_id = 0;
  of_another.have_version = 4;
  survey.bus.Publish("GRAPH_REQUEST", of_another);
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), 10u) << "who holds no graph lacks all of it";
  survey.updates.resize(6);
  for (const std::int64_t have : {std::int64_t{4}, std::numeric_limits<std::int64_t>::max()}) {
    request.have_version = have;
    survey.bus.Publish("GRAPH_REQUEST", request);
  }
  request.sender = "mapper";
  request.have_version = 0;
  survey.bus.Publish("GRAPH_REQUEST", request);
  survey.bus.HandleAll();
  EXPECT_EQ(survey.updates.size(), 6u);
  request.sender = "optimizer";
  request.graph_id = survey.updates.front().graph_id;
  request.have_version = std::numeric_limits<std::int64_t>::min();
  survey.bus.Publish("GRAPH_REQUEST", request);
  survey.bus.HandleAll();
  EXPECT_EQ(survey.updates.size(), 10u);
}

TEST(MapperNode, RegistersImportedSubmapsThatOverlap) {
  Survey survey;
  survey.node->AddSubmap(ImportedSubmap(2, 0.0));
  survey.node->AddSubmap(ImportedSubmap(5, 40.0));
  survey.node->AddSubmap(ImportedSubmap(6, 4.0));
  survey.Finish();
  ASSERT_EQ(survey.submaps.size(), 3u);
  EXPECT_EQ(survey.submaps[2].cloud.size(), ImportedSubmap(6, 4.0).cloud.size());
  ASSERT_EQ(survey.updates.size(), 4u);
  ASSERT_EQ(survey.updates[2].edges.size(), 2u);
  EXPECT_EQ(survey.updates[2].edges[1].from.value, 2);
  EXPECT_EQ(survey.updates[2].edges[1].kind, EdgeKind::kLoopClosure);
}

TEST(MapperNode, RefusesSubmapsThatCannotBe) {
  Survey survey;
  survey.node->AddSubmap(ImportedSubmap(3, 0.0));
  survey.node->AddSubmap(ImportedSubmap(3, 40.0));
  Submap bad = ImportedSubmap(4, 0.0);
  bad.T_map_submap.translation().x() = std::numeric_limits<double>::quiet_NaN();
  survey.node->AddSubmap(bad);
  survey.Finish();
  EXPECT_EQ(survey.updates.size(), 2u);
  EXPECT_EQ(survey.node->health().counter("submaps_refused"), 2);
}

TEST(MapperNode, KeepsTheOrderOfSubmapsAndBoundsWhatWaitsForTheWorker) {
  HeldWorker worker;
  Survey survey(&worker);
  constexpr int kSubmaps = 10;
  for (int id = 0; id < kSubmaps; ++id) survey.node->AddSubmap(ImportedSubmap(id, 2.0 * id));
  survey.bus.HandleAll();
  EXPECT_TRUE(survey.updates.empty());
  EXPECT_EQ(worker.queue_depth(), 1u);
  worker.RunAll();
  survey.bus.HandleAll();
  ASSERT_EQ(survey.updates.size(), kSubmaps);
  for (int id = 0; id < kSubmaps; ++id) {
    EXPECT_EQ(survey.updates[static_cast<std::size_t>(id)].version, id + 1);
    EXPECT_EQ(survey.updates[static_cast<std::size_t>(id)].vertices[0].id.value, id);
  }
  EXPECT_EQ(survey.node->health().counter("submaps_skipped_busy"), kSubmaps - 2);
  // With or without registration.
  EXPECT_EQ(survey.node->health().counter("store_saved"), kSubmaps);
  EXPECT_EQ(survey.updates[1].edges.size(), 2u);  // registered
  EXPECT_EQ(survey.updates[4].edges.size(), 1u);  // dead reckoning alone
}

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
