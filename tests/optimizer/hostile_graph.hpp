#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "common/core/graph.hpp"

namespace seastitch {

// Whatever numbers come through the checks of the wire: up to eight vertices, twelve edges.
inline GraphUpdate HostileGraph(std::mt19937_64* random) {
  const auto pick = [&](const std::vector<double>& values) {
    return values[(*random)() % values.size()];
  };
  const auto vertex = [&] { return SubmapId{static_cast<std::int32_t>((*random)() % 8)}; };
  const std::vector<double> lengths{0.0, -3.0, 10.0, 1e-300, 1e7, -1e7, 1e4};
  const std::vector<double> informations{0.0, 1e-300, 1e-12, 1.0, 1e4, 1e10};
  const int vertices = 1 + static_cast<int>((*random)() % 8);
  GraphUpdate update{1, {}, {}};
  update.mounting = {(*random)() % 3 == 0 ? 0.3 : 0.0, (*random)() % 3 == 0 ? 1e-9 : 0.0};
  for (int v = 0; v < vertices; ++v) {
    const Pose2 pose{pick(lengths), pick(lengths), pick(lengths)};
    update.vertices.push_back({SubmapId{v}, {}, pose, pick({0.0, 1e-5, 0.02, 3.0}), v / 5});
  }
  for (int e = 0; e < 12; ++e) {
    GraphEdge edge;
    edge.kind = static_cast<EdgeKind>((*random)() % 3);
    edge.from = vertex();
    edge.to = edge.kind == EdgeKind::kPositionFix ? edge.from : vertex();
    edge.T_from_to = {pick(lengths), pick(lengths), pick(lengths)};
    edge.overlap_center_m = {pick(lengths), pick(lengths)};
    for (double& information : edge.information.diagonal()) information = pick(informations);
    update.edges.push_back(edge);
  }
  return update;
}

inline bool HasOnlyNumbers(const PoseGraph& solution) {
  return std::all_of(solution.mounting.begin(),
                     solution.mounting.end(),
                     [](const auto& of_dive) {
                       return of_dive.second.Vector().allFinite() &&
                              of_dive.second.covariance.allFinite();
                     }) &&
         std::all_of(
             solution.vertices.begin(), solution.vertices.end(), [](const SolvedVertex& vertex) {
               return vertex.T_map_level.Vector().allFinite() && vertex.covariance.allFinite() &&
                      vertex.covariance_with_newest.allFinite();
             });
}

}  // namespace seastitch
