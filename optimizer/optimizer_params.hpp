#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

// See TableOf() for what each is.
struct OptimizerParams {
  // A wrong closure is rarely within 4 sigma.
  double inlier_probability = 0.999;
  // The literature has 1.4; on simulated surveys with up to 70 % wrong closures 2, 4 and 10 gave
  // the same answer, so this is the quick one.
  double graduation_step = 4.0;
  int max_iterations = 100;
  // It may be anywhere near, but not nowhere.
  double unlinked_sigma_m = 100.0;
  double unlinked_sigma_yaw_rad = Deg2Rad(30.0);
};

}  // namespace seastitch
