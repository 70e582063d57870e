#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

// Parameters of the solution; TableOf() (optimizer_config.hpp) has their meaning and range.
struct OptimizerParams {
  // A wrong closure is rarely within 4 sigma.
  double inlier_probability = 0.999;
  // The literature has 1.4; on simulated surveys with up to 70 % wrong closures 2, 4 and 10 gave
  // the same answer, so this is the quick one.
  double graduation_step = 4.0;
  int max_iterations = 100;
  // Loose, but finite: the submap is somewhere near.
  double unlinked_sigma_m = 100.0;
  double unlinked_sigma_yaw_rad = Deg2Rad(30.0);
};

}  // namespace seastitch
