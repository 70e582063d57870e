#include "tests/mapper/mapper_node_fixtures.hpp"

namespace seastitch {
namespace {

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

}  // namespace
}  // namespace seastitch
