#pragma once

#include <string>

#include "optimizer/pose_graph_optimizer.hpp"

namespace seastitch {

// What config/optimizer.yaml holds; every key is explained there.
struct OptimizerConfig {
  OptimizerParams params;
};

// Throws ConfigError.
OptimizerConfig LoadOptimizerConfig(const std::string& path);

}  // namespace seastitch
