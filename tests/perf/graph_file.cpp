#include "tests/perf/graph_file.hpp"

#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

// One line a thing, its update's version after its name; %.17g keeps every bit of a double.
namespace seastitch {
namespace {

void Write(const Pose2& pose, std::ostream* out) {
  *out << ' ' << pose.x << ' ' << pose.y << ' ' << pose.yaw;
}

Pose2 ReadPose(std::istream* in) {
  Pose2 pose;
  *in >> pose.x >> pose.y >> pose.yaw;
  return pose;
}

void Write(const GraphEdge& edge, std::ostream* out) {
  *out << ' ' << static_cast<int>(edge.kind) << ' ' << static_cast<int>(edge.verdict) << ' '
       << edge.from.value << ' ' << edge.to.value;
  Write(edge.T_from_to, out);
  for (const double value : edge.information.reshaped()) *out << ' ' << value;
  for (const double value : edge.overlap_center_m) *out << ' ' << value;
}

GraphEdge ReadEdge(std::istream* in) {
  GraphEdge edge;
  int kind = 0, verdict = 0;
  *in >> kind >> verdict >> edge.from.value >> edge.to.value;
  edge.kind = static_cast<EdgeKind>(kind);
  edge.verdict = static_cast<LoopVerdict>(verdict);
  edge.T_from_to = ReadPose(in);
  for (double& value : edge.information.reshaped()) *in >> value;
  for (double& value : edge.overlap_center_m) *in >> value;
  return edge;
}

void ReadLine(std::istream* in, RecordedGraph* graph) {
  std::string what;
  std::int64_t version = 0;
  *in >> what >> version;
  if (what == "update") {
    GraphUpdate& update = graph->updates.emplace_back();
    update.version = version;
    *in >> update.mounting.sonar_m >> update.mounting.dvl_yaw_rad;
    return;
  }
  if (graph->updates.empty() || graph->updates.back().version != version)
    throw std::runtime_error("a " + what + " before its update");
  if (what == "vertex") {
    GraphVertex vertex;
    std::int64_t utime = 0;
    *in >> vertex.id.value >> utime;
    vertex.time = FromUtime(utime);
    vertex.dead_reckoned = ReadPose(in);
    double heading_sigma_rad = 0.0;  // 0: not known
    *in >> heading_sigma_rad;
    if (heading_sigma_rad > 0.0) vertex.heading_sigma_rad = heading_sigma_rad;
    graph->updates.back().vertices.push_back(vertex);
    graph->truth.push_back(ReadPose(in));
  } else if (what == "edge") {
    graph->updates.back().edges.push_back(ReadEdge(in));
  } else {
    throw std::runtime_error("'" + what + "' is no update, vertex or edge");
  }
}

}  // namespace

void SaveGraph(const RecordedGraph& graph, const std::filesystem::path& file) {
  std::ofstream out(file);
  out.precision(std::numeric_limits<double>::max_digits10);
  auto truth = graph.truth.begin();
  for (const GraphUpdate& update : graph.updates) {
    out << "update " << update.version << ' ' << update.mounting.sonar_m << ' '
        << update.mounting.dvl_yaw_rad << '\n';
    for (const GraphVertex& vertex : update.vertices) {
      out << "vertex " << update.version << ' ' << vertex.id.value << ' ' << ToUtime(vertex.time);
      Write(vertex.dead_reckoned, &out);
      out << ' ' << vertex.heading_sigma_rad.value_or(0.0);
      Write(*truth++, &out);
      out << '\n';
    }
    for (const GraphEdge& edge : update.edges) {
      out << "edge " << update.version;
      Write(edge, &out);
      out << '\n';
    }
  }
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot write");
}

RecordedGraph LoadGraph(const std::filesystem::path& file) {
  std::ifstream in(file);
  RecordedGraph graph;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    ReadLine(&words, &graph);
    if (!words) throw std::runtime_error(file.string() + ": cut short: " + line);
  }
  if (graph.updates.empty()) throw std::runtime_error(file.string() + ": holds no graph");
  return graph;
}

}  // namespace seastitch
