#pragma once

#include <map>

#include "optimizer/factor_graph.hpp"
#include "optimizer/graph_store.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// Factor graph of a stored graph with at least one vertex. Factors in this order: priors of the
// mounting, anchor of the first submap, dead reckoning, headings, then GraphStore::RobustEdges().
// The errors of mounting, where they are estimated, are the last vertex.
FactorGraph BuildFactorGraph(const GraphStore& store, const OptimizerParams& params);

// Vertex number of each submap of the graph.
std::map<SubmapId, int> VertexNumbers(const GraphStore& store);

// by_mounting with zero columns for the errors that are not estimated; columns (sonar_m,
// dvl_yaw_rad).
Eigen::Matrix3d EstimatedColumns(const Eigen::Matrix3d& by_mounting, const MountingSigmas& sigmas);

}  // namespace seastitch
