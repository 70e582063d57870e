// A session joins mapper and optimizer by calls. What they make is what their processes make, which
// exchange messages.
#include "survey/session/mapping_session.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "mapper/mapper_node.hpp"
#include "optimizer/optimizer_config.hpp"
#include "optimizer/optimizer_node.hpp"
#include "survey/read/log_source.hpp"
#include "survey/session/computation_beside.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

template <class Msg>
std::string Encoded(const Msg& msg) {
  std::string bytes(static_cast<std::size_t>(msg.getEncodedSize()), '\0');
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// Versions of a graph, as the bytes of their messages, and the last solution of all.
struct Graph {
  std::vector<std::string> updates;
  std::vector<std::string> solution;
  std::size_t closures = 0;
};

class Session : public testing::Test {
 protected:
  void SetUp() override {
    const CommandResult made =
        RunCommand(Program("seastitch") + " bench --survey " + ConfigFile("bench/short.yaml") +
                   " --log " + log_.string());
    ASSERT_EQ(made.exit_code, 0) << made.output;
  }
  MapperConfig Config(const char* map) const {
    MapperConfig config = LoadMapperConfig(ConfigFile("mapper.yaml"));
    config.map_dir = dir_.path() / map;
    return config;
  }
  static void AddSolution(const PoseGraph& solution, Graph* graph) {
    graph->solution.clear();
    for (pose_graph_t part : ToLcm(solution, 0, Time{}, 0))
      graph->solution.push_back(Encoded(part));
    graph->closures = solution.loop_edges.size();
  }

  Graph OfNodes() const {
    Graph graph;
    Bus bus("memq://");
    InlineWorker worker;
    bus.Subscribe<graph_update_t>(channels::kGraphUpdate, 0, [&](graph_update_t msg) {
      msg.seq = 0;
      graph.updates.push_back(Encoded(msg));
    });
    PoseGraphAssembler assembler;
    bus.Subscribe<pose_graph_t>(channels::kPoseGraph, 0, [&](const pose_graph_t& msg) {
      if (const auto solution = assembler.Add(msg)) AddSolution(*solution, &graph);
    });
    MapperNode mapper(Config("of_nodes"), &bus, &worker);
    OptimizerNode optimizer(LoadOptimizerConfig(ConfigFile("optimizer.yaml")), &bus, &worker);
    const auto settle = [&] {
      bus.HandleAll();
      while (mapper.LookAgain()) bus.HandleAll();
    };
    EventLogReader reader(log_);
    while (const auto event = reader.Next()) {
      const Channel* const channel = FindChannel(event->channel);
      if (channel == nullptr || channel->role != ChannelRole::kSensor) continue;
      bus.PublishBytes(event->channel, event->data.data(), event->data.size());
      bus.HandleAll();
    }
    mapper.Finish();
    settle();
    return graph;
  }

  Graph OfSession(const std::function<void(const MapperEvent&)>& also = {}) const {
    Graph graph;
    SurveyCollector collector(dir_.path() / "products");
    MappingSession session(
        Config("of_session"),
        LoadOptimizerConfig(ConfigFile("optimizer.yaml")),
        &collector,
        [] { return false; },
        [&](const MapperEvent& event) {
          if (const auto* step = std::get_if<GraphStep>(&event))
            graph.updates.push_back(Encoded(ToLcm(step->update, step->submap_time, 0)));
          if (also) also(event);
        });
    LogSource source(ScanLogs({log_}, true), nullptr, true);
    while (const auto sample = source.Next()) session.Add(*sample);
    session.Finish();
    AddSolution(collector.Finish().solution, &graph);
    EXPECT_TRUE(source.refused().empty());
    EXPECT_TRUE(source.messages().empty());
    return graph;
  }

 private:
  TemporaryDir dir_;
  const fs::path log_ = dir_.path() / "short.lcmlog";
};

TEST_F(Session, MakesTheGraphOfTheProcesses) {
  const Graph nodes = OfNodes();
  const Graph session = OfSession();
  EXPECT_GT(nodes.closures, 10u);
  EXPECT_GT(nodes.updates.size(), 5u);
  EXPECT_EQ(session.updates.size(), nodes.updates.size());
  EXPECT_TRUE(session.updates == nodes.updates);
  EXPECT_TRUE(session.solution == nodes.solution);
}

// Its registrations run beside the samples that follow. A submap joins the graph some seconds of
// the dive after it closed, or as soon as the next closes, however long its registrations take.
TEST_F(Session, TakesTheResultsOfRegistrationsAtATimeOfTheDive) {
  struct Joined {
    double after_s;
    std::size_t closed;  // submaps that had closed by then
  };
  std::vector<Time> closed;
  std::vector<Joined> joined;
  Time now;
  OfSession([&](const MapperEvent& event) {
    if (const auto* nav = std::get_if<NavState>(&event)) now = nav->time;
    if (std::holds_alternative<std::shared_ptr<const Submap>>(event)) closed.push_back(now);
    if (const auto* step = std::get_if<GraphStep>(&event); step && !step->update.vertices.empty())
      joined.push_back({ToSeconds(now - closed[joined.size()]), closed.size()});
  });
  ASSERT_EQ(joined.size(), closed.size());
  int later = 0;
  for (std::size_t k = 0; k + 1 < joined.size(); ++k) {  // the last joins at the end
    if (joined[k].closed == k + 1) {
      EXPECT_NEAR(joined[k].after_s, kTakenAfterS, 0.05);
      ++later;
    } else {
      EXPECT_EQ(joined[k].closed, k + 2);
    }
  }
  EXPECT_GT(later, 3);
}

// A submap of another program, far from its frame's origin or with a fix that is not finite, loses
// the edge alone: the map goes on, and the report says so.
TEST_F(Session, GoesOnWithoutAMalformedEdge) {
  const TemporaryDir dir;
  MapperConfig config = Config("of_submaps");
  SurveyCollector collector(dir.path() / "products");
  MappingSession session(
      config,
      LoadOptimizerConfig(ConfigFile("optimizer.yaml")),
      &collector,
      [] { return false; },
      [](const MapperEvent&) {});
  for (int id = 0; id < 3; ++id) {
    Submap submap;
    submap.id = SubmapId{id};
    submap.start = submap.frame_time = submap.end = FromUtime(1'000'000 * (id + 1));
    submap.T_map_submap.translation().x() = 60.0 * id;
    if (id > 0) submap.covariance_from_previous = Eigen::Matrix3d::Identity() * 0.01;
    for (int i = 0; i < 900; ++i)
      submap.cloud.Add({static_cast<float>(i % 30), static_cast<float>(i / 30), 20.0f});
    GraphEdge fix;
    fix.kind = EdgeKind::kPositionFix;
    fix.from = fix.to = submap.id;
    fix.T_from_to = {60.0 * id, 0.0, 0.0};
    fix.information = Eigen::Matrix3d::Identity();
    if (id == 1) fix.information(0, 0) = std::numeric_limits<double>::quiet_NaN();
    session.AddSubmap(std::move(submap), Mapper::OfDive{{0, std::nullopt, {}}, {fix}, {}});
  }
  session.Finish();
  EXPECT_EQ(collector.Finish().solution.vertices.size(), 3u);
  EXPECT_EQ(session.refused().at("updates_malformed"), 1);
  EXPECT_TRUE(session.optimizer_faults().empty());
}

}  // namespace
}  // namespace seastitch
