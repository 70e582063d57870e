// seastitch-bench-graphs: the optimizer on graphs of whole surveys that seastitch-bench-surveys
// saved: what every submap costs as it comes, and whether the answer depends on the way to it; and
// on hostile ones.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/optimizer/hostile_graph.hpp"
#include "tests/perf/graph_file.hpp"

namespace seastitch {
namespace {

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// The graph solved after every `lot` updates from the one at `first` on, then once from dead
// reckoning.
struct Dive {
  PoseGraph last;
  PoseGraph delivered;
  double all_s = 0.0;
  double last_50_ms = 0.0;  // mean
  double full_ms = 0.0;
};

Dive SolvedOnTheWay(const std::vector<GraphUpdate>& updates, std::size_t first, std::size_t lot) {
  Dive dive;
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (std::size_t k = 0; k < updates.size(); ++k) {
    optimizer.Add(updates[k]);
    if (k < first || (k - first) % lot != 0) continue;
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

// Of x, y and yaw, in their sigmas.
double LargestOffsetSigma(const PoseGraph& a, const PoseGraph& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    const SolvedVertex& vertex = a.vertices[k];
    Eigen::Vector3d off = vertex.T_map_level.Vector() - b.vertices[k].T_map_level.Vector();
    off.z() = WrapAngle(off.z());
    const Eigen::Vector3d sigma = vertex.covariance.diagonal().cwiseSqrt().cwiseMax(1e-9);
    largest = std::max(largest, off.cwiseQuotient(sigma).cwiseAbs().maxCoeff());
  }
  return largest;
}

bool HaveSameVerdicts(const PoseGraph& a, const PoseGraph& b) {
  return std::equal(a.loop_edges.begin(),
                    a.loop_edges.end(),
                    b.loop_edges.begin(),
                    b.loop_edges.end(),
                    [](const SolvedEdge& x, const SolvedEdge& y) {
                      return (x.weight >= kAcceptedWeight) == (y.weight >= kAcceptedWeight);
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
    const Dive dive = SolvedOnTheWay(graph.updates, 0, 1);
    std::printf("| %s | %zu | %.2f | %.1f | %.0f |\n",
                file.c_str(),
                graph.truth.size(),
                dive.all_s,
                dive.last_50_ms,
                dive.full_ms);
  }
}

// One draw of wrong closures, against one batch solve.
struct Differences {
  int on_the_way = 0;  // solved as it comes, before the last solve
  double on_the_way_m = 0.0;
  std::array<int, 3> delivered{};  // as it comes, in lots of seven, restarted half-way
};

void Compare(const std::vector<GraphUpdate>& updates, Differences* differences) {
  const PoseGraph batch = Batch(updates);
  const std::array<Dive, 3> dives{SolvedOnTheWay(updates, 0, 1),
                                  SolvedOnTheWay(updates, 0, 7),
                                  SolvedOnTheWay(updates, updates.size() / 2, 1)};
  for (std::size_t k = 0; k < dives.size(); ++k) {
    const PoseGraph& delivered = dives[k].delivered;
    if (LargestOffsetSigma(batch, delivered) > 1e-3 || !HaveSameVerdicts(batch, delivered))
      ++differences->delivered[k];
  }
  const double offset_m = LargestOffset(dives[0].last, batch);
  differences->on_the_way_m = std::max(differences->on_the_way_m, offset_m);
  if (offset_m > 0.01 || !HaveSameVerdicts(dives[0].last, batch)) ++differences->on_the_way;
}

void DependenceTable(const std::vector<std::string>& files, int draws) {
  std::printf(
      "\nAgainst one batch solve, with wrong closures. Before the last solve a verdict or 1 cm "
      "differs; as delivered a\nverdict or 0.001 sigma.\n\n"
      "| wrong | share %% | draws | before the last solve | by m | delivered, as it comes | in "
      "lots "
      "| restarted |\n|---|---|---|---|---|---|---|---|\n");
  for (const std::size_t alike : {1, 5}) {
    for (const double share : {0.1, 0.3, 0.5}) {
      int drawn = 0;
      Differences differ;
      for (const std::string& file : files) {
        const RecordedGraph graph = LoadGraph(file);
        for (int seed = 1; seed <= draws; ++seed, ++drawn)
          Compare(WithWrongClosures(graph.updates, share, alike, static_cast<unsigned>(seed)),
                  &differ);
      }
      std::printf("| %s | %.0f | %d | %d | %.3f | %d | %d | %d |\n",
                  alike == 1 ? "alone" : "five alike",
                  100.0 * share,
                  drawn,
                  differ.on_the_way,
                  differ.on_the_way_m,
                  differ.delivered[0],
                  differ.delivered[1],
                  differ.delivered[2]);
      std::fflush(stdout);
    }
  }
}

// Each solved three times.
void HostileTable(int graphs) {
  std::mt19937_64 random(9);
  int solved = 0, not_converged = 0, no_covariance = 0, none = 0, no_numbers = 0, untold = 0;
  for (int n = 0; n < graphs; ++n) {
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    optimizer.Add(HostileGraph(&random));
    for (const SolveStart start :
         {SolveStart::kWarm, SolveStart::kWarm, SolveStart::kFromDeadReckoning}) {
      const std::optional<PoseGraph> solution = optimizer.Solve(start);
      const auto counted = optimizer.counters();
      const auto tell = [&](bool fails, const char* counter, int* count) {
        *count += fails ? 1 : 0;
        untold += fails && !counted.contains(counter) ? 1 : 0;
      };
      tell(!solution, "solutions_not_finite", &none);
      if (!solution) continue;
      ++solved;
      tell(!optimizer.converged(), "solves_not_converged", &not_converged);
      tell(optimizer.lacks_covariance(), "covariance_failed", &no_covariance);
      no_numbers += HasOnlyNumbers(*solution) ? 0 : 1;
    }
  }
  std::printf(
      "\n| hostile graphs | solutions | not converged | without covariance | no solution | NaN or "
      "infinite | not counted |\n|---|---|---|---|---|---|---|\n"
      "| %d | %d | %d | %d | %d | %d | %d |\n",
      graphs,
      solved,
      not_converged,
      no_covariance,
      none,
      no_numbers,
      untold);
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) {
  std::vector<std::string> graphs;
  int draws = 4;
  int hostile = 0;
  CLI::App app("The optimizer on saved graphs: time, and whether the answer depends on the way");
  app.add_option("graphs", graphs, "files of seastitch-bench-surveys --save-graphs");
  app.add_option("--draws", draws, "of wrong closures, a graph and share")->capture_default_str();
  app.add_option("--hostile", hostile, "graphs of numbers that cannot be, beside them");
  CLI11_PARSE(app, argc, argv);
  try {
    if (!graphs.empty()) seastitch::TimeTable(graphs);
    if (!graphs.empty() && draws > 0) seastitch::DependenceTable(graphs, draws);
    if (hostile > 0) seastitch::HostileTable(hostile);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "seastitch-bench-graphs: %s\n", e.what());
    return 1;
  }
  return 0;
}
