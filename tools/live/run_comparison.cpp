#include "tools/live/run_comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/core/pose.hpp"
#include "common/runtime/files/whole_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

std::ifstream Open(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be opened");
  return in;
}

std::string Bytes(const fs::path& file) {
  std::optional<std::string> bytes = ReadWholeFile(file);
  if (!bytes) throw std::runtime_error(file.string() + ": cannot be opened");
  return *std::move(bytes);
}

std::set<std::string> SubmapFiles(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".pcd") names.insert(entry.path().filename().string());
  return names;
}

// Lines of graph.g2o by "target-source"; for neighbours this includes dead reckoning.
std::map<std::string, std::string> Edges(const fs::path& products) {
  std::map<std::string, std::string> edges;
  std::ifstream in = Open(products / "graph.g2o");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string tag;
    std::string from;
    std::string to;
    words >> tag >> from >> to;
    if (tag == "EDGE_SE2") edges[from + "-" + to] += line;
  }
  return edges;
}

// Solved vertices of graph.g2o by id: x, y [m], yaw [rad].
std::map<int, Pose2> Vertices(const fs::path& products) {
  std::map<int, Pose2> vertices;
  std::ifstream in = Open(products / "graph.g2o");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string tag;
    int id = 0;
    Pose2 pose;
    if (words >> tag >> id >> pose.x >> pose.y >> pose.yaw && tag == "VERTEX_SE2")
      vertices[id] = pose;
  }
  return vertices;
}

// The smallest sigmas of x, y [m] and yaw [rad] along track.csv.
std::array<double, 3> SmallestSigmas(const fs::path& products) {
  const fs::path file = products / "track.csv";
  std::ifstream in = Open(file);
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream parts(line);
    for (std::string cell; std::getline(parts, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = cells_of(line);
  std::array<std::size_t, 3> columns{};
  const char* const wanted[] = {"sigma_x_m", "sigma_y_m", "sigma_yaw_deg"};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), wanted[i]);
    if (found == names.end()) throw std::runtime_error(file.string() + ": no " + wanted[i]);
    columns[i] = static_cast<std::size_t>(found - names.begin());
  }
  std::array<double, 3> smallest;
  smallest.fill(std::numeric_limits<double>::infinity());
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (columns[i] < cells.size() && !cells[columns[i]].empty())
        smallest[i] = std::min(smallest[i], std::stod(cells[columns[i]]));
  }
  smallest[2] = Deg2Rad(smallest[2]);
  return smallest;
}

// Of the submaps' poses: the track between them is smoothed in a replay of the sensors alone.
double PosesApart(const fs::path& first, const fs::path& second) {
  const std::map<int, Pose2> vertices = Vertices(first), others = Vertices(second);
  const std::array<double, 3> sigma = SmallestSigmas(second);
  double most = 0.0;
  for (const auto& [id, pose] : vertices) {
    const auto found = others.find(id);
    if (found == others.end()) continue;
    most = std::max({most,
                     std::abs(pose.x - found->second.x) / sigma[0],
                     std::abs(pose.y - found->second.y) / sigma[1],
                     std::abs(WrapAngle(pose.yaw - found->second.yaw)) / sigma[2]});
  }
  return most;
}

// At most five, and the number of the others.
std::string List(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) text += " " + names[i];
  if (names.size() > kMost) text += " and " + std::to_string(names.size() - kMost) + " more";
  return text;
}

}  // namespace

RunComparison CompareRuns(const RunFolders& first, const RunFolders& second) {
  RunComparison out;
  std::set<std::string> files = SubmapFiles(first.submaps);
  const std::set<std::string> others = SubmapFiles(second.submaps);
  files.insert(others.begin(), others.end());
  out.submaps = files.size();
  for (const std::string& name : files) {
    const fs::path a = first.submaps / name;
    const fs::path b = second.submaps / name;
    const bool both = fs::exists(a) && fs::exists(b);
    if (!both || Bytes(a) != Bytes(b)) out.submaps_apart.push_back(name);
  }
  const auto edges = Edges(first.products);
  const auto other_edges = Edges(second.products);
  for (const auto& [pair, line] : edges) {
    const auto found = other_edges.find(pair);
    if (found == other_edges.end()) {
      out.first_alone.push_back(pair);
    } else {
      ++out.edges;
      if (found->second != line) out.edges_apart.push_back(pair);
    }
  }
  for (const auto& [pair, line] : other_edges)
    if (!edges.contains(pair)) out.second_alone.push_back(pair);
  out.poses_apart = PosesApart(first.products, second.products);
  return out;
}

std::string Text(const RunComparison& c, const std::string& first, const std::string& second) {
  const auto same = [](std::size_t all, const std::vector<std::string>& apart) {
    return std::to_string(all - apart.size()) + " of " + std::to_string(all);
  };
  std::string text = "submaps: " + same(c.submaps, c.submaps_apart) + " have the same bytes\n";
  if (!c.submaps_apart.empty()) text += "  not the same:" + List(c.submaps_apart) + "\n";
  text += "edges of the graph: " + same(c.edges, c.edges_apart) + " have the same figures\n";
  if (!c.edges_apart.empty()) text += "  others:" + List(c.edges_apart) + "\n";
  if (!c.first_alone.empty()) text += "  " + first + " alone:" + List(c.first_alone) + "\n";
  if (!c.second_alone.empty()) text += "  " + second + " alone:" + List(c.second_alone) + "\n";
  char poses[80];
  std::snprintf(poses,
                sizeof poses,
                "poses: at most %.2f of the smallest stated sigma apart\n",
                c.poses_apart);
  return text + poses;
}

}  // namespace seastitch
