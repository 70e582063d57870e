#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace seastitch {

// Differences between the products of one survey made in two ways: at sea, and by a replay of the
// log.
struct RunComparison {
  std::size_t submaps = 0;                 // number in either
  std::vector<std::string> submaps_apart;  // files that differ, or that one of both lacks
  std::size_t edges = 0;                   // number of edges ("target-source") in both graphs
  std::vector<std::string> edges_apart;    // edges with different values
  std::vector<std::string> first_alone;
  std::vector<std::string> second_alone;
  // Most of x, y and yaw of a submap's pose, in the smallest sigmas that the second states.
  double poses_apart = 0.0;
};

// Where the results of a run are.
struct RunFolders {
  std::filesystem::path products;
  // PCD files of the submaps as they were closed. Those among the products have the pose of the
  // last solution and are sheared by it.
  std::filesystem::path submaps;
};

// Throws std::runtime_error "FILE: reason".
RunComparison CompareRuns(const RunFolders& first, const RunFolders& second);

// The differences as text for people; names: of the two runs.
std::string Text(const RunComparison& comparison,
                 const std::string& first,
                 const std::string& second);

}  // namespace seastitch
