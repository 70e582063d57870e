#pragma once

#include <map>

#include "optimizer/optimizer_params.hpp"
#include "optimizer/solver/factor_graph.hpp"
#include "optimizer/solver/graph_store.hpp"

namespace seastitch {

// Builds the factor graph of a stored graph with at least one vertex. The order of the factors is:
// prior of each dive's mounting errors, anchor of each chain's first submap, dead reckoning,
// headings, then GraphStore::RobustEdges(). The last vertices are the mounting errors, one vertex
// for each dive of GraphStore::mounting(), in that order.
FactorGraph BuildFactorGraph(const GraphStore& store, const OptimizerParams& params);

// Index of each submap's vertex in the factor graph.
std::map<SubmapId, int> VertexNumbers(const GraphStore& store);

// by_mounting (columns sonar_m.x, sonar_m.y, dvl_yaw_rad) with zeros in the columns of those errors
// that are not estimated (sigma 0).
Eigen::Matrix3d EstimatedColumns(const Eigen::Matrix3d& by_mounting, const MountingSigmas& sigmas);

}  // namespace seastitch
