#pragma once

#include <string>

#include "common/runtime/parameters.hpp"
#include "optimizer/pose_graph_optimizer.hpp"

namespace seastitch {

// What config/optimizer.yaml holds.
struct OptimizerConfig {
  OptimizerParams params;
};

// Throws ConfigError.
OptimizerConfig LoadOptimizerConfig(const std::string& path);
std::string PrintConfig(const OptimizerConfig& config);
ParameterTable TableOf(OptimizerConfig* config);

}  // namespace seastitch
