#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace seastitch {

// How the products of one survey differ that were made in two ways: at sea, and by a replay of the
// log.
struct RunComparison {
  std::size_t submaps = 0;                 // in either
  std::vector<std::string> submaps_apart;  // files that differ, or that one of them lacks
  std::size_t edges = 0;                   // of the graph, "target-source", in both
  std::vector<std::string> edges_apart;    // of these, with other figures
  std::vector<std::string> first_alone;
  std::vector<std::string> second_alone;
  double poses_apart =
      0.0;  // most of x, y and yaw along the track, in sigmas that the second states
};

// Folders of products. Throws std::runtime_error "FILE: reason".
RunComparison CompareRuns(const std::filesystem::path& first, const std::filesystem::path& second);

// Some lines for people; the runs by their names.
std::string Text(const RunComparison& comparison,
                 const std::string& first,
                 const std::string& second);

}  // namespace seastitch
