#pragma once

#include <map>

#include "optimizer/factor_graph.hpp"
#include "optimizer/graph_store.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// The factors of a stored graph, which must have a vertex: mounting, the anchor of the first
// submap, steps of dead reckoning, headings, and last, in the order of GraphStore::RobustEdges(),
// position fixes and loop closures. The errors of mounting, where they are estimated, are the last
// vertex.
FactorGraph BuildFactorGraph(const GraphStore& store, const OptimizerParams& params);

// Of the submaps in it.
std::map<SubmapId, int> VertexNumbers(const GraphStore& store);

// By (sonar_m, dvl_yaw_rad): the columns of those that are not estimated are zero.
Eigen::Matrix3d EstimatedColumns(const Eigen::Matrix3d& by_mounting, const MountingSigmas& sigmas);

}  // namespace seastitch
