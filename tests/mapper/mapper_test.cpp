#include "mapper/mapper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/convert.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/mapper/perfect_vehicle.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 1.5;

// A program that embeds a Mapper.
struct Embedding {
  explicit Embedding(const MapperParams& params = {}, std::size_t prepared_bytes = 32'000'000)
      : registration(params.loop_closer),
        mapper(params),
        prepared(registration.registration, prepared_bytes) {}

  void Drive(double duration_s, double speed_mps = kSpeedMps) {
    for (int i = 0; i < static_cast<int>(duration_s / PerfectVehicle::kImuStepS); ++i) {
      for (const auto& sample : vehicle.Step(speed_mps, 0.0))
        std::visit([this](const auto& s) { mapper.Add(s); }, sample);
      Pump();
    }
  }
  void AddSubmap(Submap submap) {
    mapper.AddSubmap(std::move(submap));
    Pump();
  }
  void Finish() {
    mapper.Finish();
    Pump();
  }
  void Pump() {
    TakeEvents();
    while (auto job = mapper.NextJob()) {
      mapper.Take(Run(*job, registration, load, &prepared));
      TakeEvents();
    }
  }
  void TakeEvents() {
    for (const MapperEvent& event : mapper.TakeEvents()) {
      if (const auto* nav = std::get_if<NavState>(&event)) navs.push_back(*nav);
      if (const auto* corrected = std::get_if<CorrectedNavState>(&event)) said = *corrected;
      if (const auto* submap = std::get_if<std::shared_ptr<const Submap>>(&event))
        submaps[(*submap)->id] = *submap;
      if (const auto* step = std::get_if<GraphStep>(&event)) steps.push_back(*step);
    }
  }
  std::vector<GraphEdge> Edges(EdgeKind kind) const {
    std::vector<GraphEdge> edges;
    for (const GraphStep& step : steps)
      for (const GraphEdge& edge : step.update.edges)
        if (edge.kind == kind) edges.push_back(edge);
    return edges;
  }

  const LoopCloserParams registration;
  PerfectVehicle vehicle;
  Mapper mapper;
  PreparedSubmaps prepared;
  std::vector<NavState> navs;
  std::optional<CorrectedNavState> said;
  std::map<SubmapId, std::shared_ptr<const Submap>> submaps;
  std::vector<GraphStep> steps;
  LoadSubmap load = [this](SubmapId id) { return submaps.at(id); };
};

// All sensors are silent for longer than navigation's history; meanwhile the vehicle does not move
// as dead reckoning extrapolates.
TEST(Mapper, TheEdgeAcrossALongGapHoldsTheTrueError) {
  Embedding dive;
  const double gap_s = MapperParams{}.navigation.window_s + 600.0;
  dive.Drive(60.0);
  const Time before = dive.vehicle.time;
  dive.vehicle.Sleep(gap_s);
  dive.Drive(60.0);
  dive.Finish();

  int across = 0;
  for (const GraphEdge& edge : dive.Edges(EdgeKind::kDeadReckoning)) {
    if (edge.from == edge.to) continue;
    const Submap& a = *dive.submaps.at(edge.from);
    const Submap& b = *dive.submaps.at(edge.to);
    const Pose2 truth = Inverse(LevelPose(dive.vehicle.TrueAt(a.frame_time))) *
                        LevelPose(dive.vehicle.TrueAt(b.frame_time));
    Eigen::Vector3d error = edge.T_from_to.Vector() - truth.Vector();
    error.z() = WrapAngle(error.z());
    EXPECT_LT(error.dot(edge.information * error), 16.3) << "99.9 % of 3 degrees of freedom";
    ASSERT_TRUE(b.covariance_from_previous.has_value());
    EXPECT_TRUE(b.heading_sigma_rad.has_value());
    if (!(a.end <= before && before < b.start)) continue;
    ++across;
    EXPECT_GT(error.head<2>().norm(), 1000.0) << "the guess was far off";
    EXPECT_GT((*b.covariance_from_previous)(0, 0), 1e6);
    EXPECT_LT((*b.covariance_from_previous)(0, 0), 1e9) << "unknown, but not without bounds";
  }
  EXPECT_EQ(across, 1);
}

// A cast of an hour ago, sent in the middle of a line. It reaches the mapper before or after the
// messages of other processes within navigation's reorder window.
TEST(Mapper, AProfileHoldsForTheSamePingsInWhicheverOrderItComes) {
  std::map<int, std::map<SubmapId, std::shared_ptr<const Submap>>> maps;
  constexpr int kNever = 5000;
  MapperParams params;
  params.submap.max_duration_s = 12.0;
  for (const int late_steps : {0, 1, 15, kNever}) {
    Embedding dive(params);
    std::int64_t seq = 0;
    Time said;
    for (int step = 0; step < 2000; ++step) {
      if (step == 1000) said = dive.vehicle.time;
      for (const auto& sample : dive.vehicle.Step(kSpeedMps, 0.0))
        std::visit([&](const auto& s) { dive.mapper.Add(s); }, sample);
      const auto say = [&](double age_s, double speed_mps, Time when) {
        const SoundVelocityProfile cast{
            when - FromSeconds(age_s), {0.0, 100.0}, {speed_mps, speed_mps}};
        dive.mapper.Add(cast, {when, seq++});
      };
      if (step == 0) say(7200.0, 1500.0, dive.vehicle.time);
      if (step == 1000 + late_steps) say(3600.0, 1450.0, said);
      dive.Pump();
    }
    dive.Finish();
    maps[late_steps] = dive.submaps;
  }
  ASSERT_GT(maps[0].size(), 1U);
  for (const int late_steps : {1, 15}) {
    ASSERT_EQ(maps[late_steps].size(), maps[0].size());
    for (const auto& [id, submap] : maps[0])
      EXPECT_TRUE(maps[late_steps].at(id)->cloud.points == submap->cloud.points)
          << "submap " << id.value << ", late by " << late_steps;
  }
  EXPECT_FALSE(maps[kNever].rbegin()->second->cloud.points ==
               maps[0].rbegin()->second->cloud.points);
}

// Only the sonar is silent for longer than navigation's history: the open submap closes after
// navigation has forgotten its frame.
TEST(Mapper, ASubmapThatClosesLateIsPlacedAsWellAsOneThatClosesAtOnce) {
  MapperParams params;
  params.navigation.window_s = 60.0;
  params.navigation.pose_window_s = 30.0;
  params.submap.max_duration_s = 30.0;
  Embedding dive(params);
  dive.Drive(70.0);
  dive.vehicle.sonar_on = false;
  dive.Drive(100.0);
  dive.vehicle.sonar_on = true;
  dive.Drive(40.0);
  dive.Finish();
  ASSERT_GE(dive.submaps.size(), 4u);
  int late = 0;
  for (const auto& [id, submap] : dive.submaps) {
    EXPECT_TRUE(submap->heading_sigma_rad.has_value()) << id.value;
    EXPECT_EQ(submap->covariance_from_previous.has_value(), id.value > 0) << id.value;
    if (submap->trigger != SubmapTrigger::kGap) continue;
    ++late;
    EXPECT_LT((*submap->covariance_from_previous)(0, 0), 1.0);
    EXPECT_GT((*submap->covariance_from_previous)(0, 0), 1e-6);
  }
  EXPECT_EQ(late, 1);
}

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
  void AddFix(double off_m) {
    const auto at = dive.vehicle.time;
    PositionFix fix;
    fix.time = at;
    fix.latitude_rad = (dive.vehicle.TrueAt(at).translation().x() + off_m) / 6335439.3;
    fix.longitude_rad = dive.vehicle.TrueAt(at).translation().y() / 6378137.0;
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    fix.source = "gps";
    dive.mapper.Add(fix);
  }
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
  constexpr double kMetresPerRadian = 6335439.3;  // of latitude, at the datum on the equator
  constexpr double kOffM = 500.0;
  MapperParams params;
  params.navigation.start_at_first_fix = true;
  Embedding dive(params);
  dive.Drive(120.0);
  PositionFix fix;
  fix.time = dive.vehicle.time;
  fix.latitude_rad = (dive.vehicle.TrueAt(fix.time).translation().x() + kOffM) / kMetresPerRadian;
  fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  dive.mapper.Add(fix);
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
  constexpr double kMetresPerRadian = 6335439.3;
  Embedding dive;
  std::multimap<Time, PositionFix> waiting;  // by arrival
  int sent = 0;
  const auto send = [&](const char* source, double age_s) {
    PositionFix fix;
    fix.time = dive.vehicle.time;
    fix.latitude_rad = dive.vehicle.TrueAt(fix.time).translation().x() / kMetresPerRadian;
    fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
    fix.source = source;
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
  constexpr double kMetresPerRadian = 6335439.3;
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
  PositionFix fix;
  fix.time = dive.vehicle.time;
  fix.latitude_rad = (dive.vehicle.TrueAt(fix.time).translation().x() + kOffM) / kMetresPerRadian;
  fix.covariance_north_east_m2 = Eigen::Matrix2d::Identity();
  dive.mapper.Add(fix);
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

TEST(Mapper, NamesItsGraphByTheFirstStateAndEndsItOnce) {
  Embedding dive;
  dive.Drive(120.0);
  dive.Finish();
  dive.Finish();
  ASSERT_GE(dive.steps.size(), 2u);
  for (std::size_t i = 0; i < dive.steps.size(); ++i) {
    const GraphUpdate& update = dive.steps[i].update;
    EXPECT_EQ(update.version, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(update.graph_id, ToUtime(dive.navs.front().time));
    EXPECT_EQ(update.final, i + 1 == dive.steps.size());
  }
}

TEST(Mapper, EndsItsGraphWithAnEmptyVersionWhereNoSubmapIsOpen) {
  Embedding dive;
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  dive.Finish();
  ASSERT_EQ(dive.steps.size(), 2u);
  EXPECT_FALSE(dive.steps[0].update.final);
  EXPECT_TRUE(dive.steps[1].update.final);
  EXPECT_TRUE(dive.steps[1].update.vertices.empty());
}

TEST(Mapper, RefusesASolutionOfAnotherGraph) {
  Embedding dive;
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  PoseGraph solution;
  solution.graph_version = 1;
  solution.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  solution.graph_id = dive.mapper.graph().graph_id() + 1;
  EXPECT_FALSE(dive.mapper.Take(solution));
  solution.graph_id = dive.mapper.graph().graph_id();
  EXPECT_TRUE(dive.mapper.Take(solution));
  EXPECT_EQ(dive.mapper.counters().at("pose_graph_refused"), 1);
}

TEST(Mapper, GoesOnWhereARegistrationEndsInAnException) {
  Embedding dive({}, 0);  // no cache of prepared submaps: every target is loaded
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  const LoadSubmap good = dive.load;
  dive.load = [](SubmapId) -> std::shared_ptr<const Submap> { throw std::bad_alloc(); };
  dive.AddSubmap(ImportedSubmap(1, 2.0));
  EXPECT_EQ(dive.mapper.counters().at("registrations_failed"), 1);
  ASSERT_EQ(dive.mapper.conditions().size(), 1u);
  EXPECT_EQ(dive.mapper.conditions()[0].kind, &conditions::kRegistrationFailed);
  EXPECT_TRUE(dive.Edges(EdgeKind::kLoopClosure).empty());
  EXPECT_EQ(dive.Edges(EdgeKind::kDeadReckoning).size(), 1u);

  dive.load = good;
  dive.AddSubmap(ImportedSubmap(2, 4.0));
  EXPECT_EQ(dive.Edges(EdgeKind::kLoopClosure).size(), 2u);
  EXPECT_TRUE(dive.mapper.conditions().empty());
}

TEST(Mapper, HandsOutOneJobAtATimeInTheOrderOfTheSubmaps) {
  Mapper mapper{MapperParams{}};
  PreparedSubmaps prepared({});
  for (const int id : {0, 1, 2}) mapper.AddSubmap(ImportedSubmap(id, 60.0 * id));
  for (const int id : {0, 1, 2}) {
    const std::optional<RegistrationJob> job = mapper.NextJob();
    ASSERT_TRUE(job.has_value());
    EXPECT_EQ(job->closed->id.value, id);
    EXPECT_FALSE(mapper.NextJob().has_value());
    mapper.Take(seastitch::Run(
        *job, {}, [](SubmapId) { return nullptr; }, &prepared));
    EXPECT_EQ(mapper.graph().version(), id + 1);
  }
  EXPECT_FALSE(mapper.NextJob().has_value());
}

TEST(Mapper, AnImportedSubmapAfterADrivenOneHasNoKnownPlaceRelativeToIt) {
  Embedding dive;
  dive.Drive(40.0);
  Submap imported = ImportedSubmap(100, 0.0);
  dive.AddSubmap(imported);
  dive.Drive(60.0);
  dive.Finish();
  const Submap& next = *dive.submaps.at(SubmapId{101});
  EXPECT_FALSE(next.covariance_from_previous.has_value());
  EXPECT_TRUE(next.heading_sigma_rad.has_value());
}

TEST(Mapper, MakesNothingOfNothing) {
  Embedding dive;
  dive.Finish();
  EXPECT_TRUE(dive.steps.empty());
  EXPECT_TRUE(dive.mapper.IsWaiting());
}

}  // namespace
}  // namespace seastitch
