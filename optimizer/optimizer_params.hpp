#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

// Parameters of the solution. TableOf() (optimizer_config.hpp) has their meaning and range.
struct OptimizerParams {
  // Measured: a wrong closure is rarely within 4 sigma.
  double inlier_probability = 0.999;
  // The literature has 1.4. On simulated surveys with up to 70 % wrong closures 2, 4 and 10 gave
  // the same solution; 4 is quick.
  double graduation_step = 4.0;
  int max_iterations = 100;
  // Large but finite, so that the graph stays well conditioned.
  double unlinked_sigma_m = 100.0;
  double unlinked_sigma_yaw_rad = Deg2Rad(30.0);
};

}  // namespace seastitch
