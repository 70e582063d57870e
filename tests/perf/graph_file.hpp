#pragma once

#include <filesystem>
#include <vector>

#include "common/core/graph.hpp"

// The graph of a survey with its truth, in one text file, so that solvers can be compared on it
// without simulating the survey again.
namespace seastitch {

struct RecordedGraph {
  std::vector<GraphUpdate> updates;
  std::vector<Pose2> truth;  // one a vertex, in the order of the updates
};

// Both throw std::runtime_error naming the file.
void SaveGraph(const RecordedGraph& graph, const std::filesystem::path& file);
RecordedGraph LoadGraph(const std::filesystem::path& file);

}  // namespace seastitch
