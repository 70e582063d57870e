// seastitch-bench-graphs: the optimizer on graphs of whole surveys that seastitch-bench-surveys
// saved: what every submap costs as it comes, and whether the answer depends on the way to it.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/perf/graph_file.hpp"

namespace seastitch {
namespace {

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Every submap solved as it comes, then once from dead reckoning.
struct Dive {
  PoseGraph last;
  PoseGraph delivered;
  double all_s = 0.0;
  double last_50_ms = 0.0;  // mean
  double full_ms = 0.0;
};

Dive AsItComes(const std::vector<GraphUpdate>& updates) {
  Dive dive;
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (std::size_t k = 0; k < updates.size(); ++k) {
    optimizer.Add(updates[k]);
    const double start_s = CpuSeconds();
    dive.last = optimizer.Solve().value();
    const double took_s = CpuSeconds() - start_s;
    dive.all_s += took_s;
    if (k + 50 >= updates.size()) dive.last_50_ms += 1e3 * took_s / 50.0;
  }
  const double start_s = CpuSeconds();
  dive.delivered = optimizer.Solve(SolveStart::kFromDeadReckoning).value();
  dive.full_ms = 1e3 * (CpuSeconds() - start_s);
  return dive;
}

PoseGraph Batch(const std::vector<GraphUpdate>& updates) {
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) optimizer.Add(update);
  return optimizer.Solve().value();
}

double LargestOffset(const PoseGraph& a, const PoseGraph& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k)
    largest = std::max(
        largest,
        (a.vertices[k].T_map_level.Translation() - b.vertices[k].T_map_level.Translation()).norm());
  return largest;
}

bool HaveSameVerdicts(const PoseGraph& a, const PoseGraph& b) {
  return std::equal(a.loop_edges.begin(),
                    a.loop_edges.end(),
                    b.loop_edges.begin(),
                    b.loop_edges.end(),
                    [](const SolvedEdge& x, const SolvedEdge& y) {
                      return (x.weight >= kBelievedWeight) == (y.weight >= kBelievedWeight);
                    });
}

// A share of the accepted closures 2 to 16 m off, `alike` in a row by the same vector of the map.
std::vector<GraphUpdate> WithWrongClosures(std::vector<GraphUpdate> updates,
                                           double share,
                                           std::size_t alike,
                                           unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::map<std::pair<SubmapId, SubmapId>, GraphEdge*> closures;
  std::map<SubmapId, Pose2> dead_reckoned;
  for (GraphUpdate& update : updates) {
    for (const GraphVertex& v : update.vertices) dead_reckoned[v.id] = v.dead_reckoned;
    for (GraphEdge& e : update.edges)
      if (e.kind == EdgeKind::kLoopClosure && e.verdict == LoopVerdict::kAccepted)
        closures[{e.to, e.from}] = &e;
  }
  std::size_t n = 0;
  bool is_wrong = false;
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();
  for (const auto& [pair, edge] : closures) {
    if (n++ % alike == 0) {
      is_wrong = uniform(random) < share;
      const double direction = 2.0 * kPi * uniform(random);
      offset_m = (2.0 + 14.0 * uniform(random)) *
                 Eigen::Vector2d(std::cos(direction), std::sin(direction));
    }
    if (!is_wrong) continue;
    const Eigen::Vector2d in_from = dead_reckoned.at(edge->from).Rotation().transpose() * offset_m;
    edge->T_from_to.x += in_from.x();
    edge->T_from_to.y += in_from.y();
  }
  return updates;
}

void TimeTable(const std::vector<std::string>& files) {
  std::printf(
      "| graph | submaps | all updates s | mean of the last 50 ms | from dead reckoning ms |\n"
      "|---|---|---|---|---|\n");
  for (const std::string& file : files) {
    const RecordedGraph graph = LoadGraph(file);
    const Dive dive = AsItComes(graph.updates);
    std::printf("| %s | %zu | %.2f | %.1f | %.0f |\n",
                file.c_str(),
                graph.truth.size(),
                dive.all_s,
                dive.last_50_ms,
                dive.full_ms);
  }
}

void IncrementalTable(const std::vector<std::string>& files, int draws) {
  std::printf(
      "\nAs it comes against one batch solve, with wrong closures; differs: a verdict, or a "
      "position by 1 cm.\n\n| wrong | share %% | draws | differ before the last solve | by m | "
      "differ as delivered |\n|---|---|---|---|---|---|\n");
  for (const std::size_t alike : {1, 5}) {
    for (const double share : {0.1, 0.3, 0.5}) {
      int drawn = 0, differ = 0, delivered_differ = 0;
      double by_m = 0.0;
      for (const std::string& file : files) {
        const RecordedGraph graph = LoadGraph(file);
        for (int seed = 1; seed <= draws; ++seed, ++drawn) {
          const auto updates =
              WithWrongClosures(graph.updates, share, alike, static_cast<unsigned>(seed));
          const Dive dive = AsItComes(updates);
          const PoseGraph batch = Batch(updates);
          const double offset_m = LargestOffset(dive.last, batch);
          differ += offset_m > 0.01 || !HaveSameVerdicts(dive.last, batch) ? 1 : 0;
          by_m = std::max(by_m, offset_m);
          delivered_differ += LargestOffset(dive.delivered, batch) > 0.0 ? 1 : 0;
        }
      }
      std::printf("| %s | %.0f | %d | %d | %.3f | %d |\n",
                  alike == 1 ? "alone" : "five alike",
                  100.0 * share,
                  drawn,
                  differ,
                  by_m,
                  delivered_differ);
    }
  }
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  std::vector<std::string> graphs;
  int draws = 2;
  CLI::App app("The optimizer on saved graphs: time, and whether the answer depends on the way");
  app.add_option("graphs", graphs, "files of seastitch-bench-surveys --save-graphs")->required();
  app.add_option("--draws", draws, "of wrong closures, a graph and share")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    seastitch::TimeTable(graphs);
    if (draws > 0) seastitch::IncrementalTable(graphs, draws);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-graphs: %s\n", e.what());
    return 1;
  }
  return 0;
}
