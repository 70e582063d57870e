#pragma once

#include <string>

#include "common/parameters/parameters.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// config/optimizer.yaml. Throws ConfigError.
OptimizerParams LoadOptimizerConfig(const std::string& path);
std::string PrintConfig(const OptimizerParams& params);
ParameterTable TableOf(OptimizerParams* params);

}  // namespace seastitch
