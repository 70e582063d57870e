#pragma once

#include "common/core/pose.hpp"

namespace seastitch {

struct OptimizerParams {
  // A loop closure or position fix whose squared Mahalanobis distance from the solution is below
  // this quantile of chi-square (degrees of freedom: the rank of its information) is accepted.
  // 0.999 loses one honest closure in a thousand; a wrong one is rarely within 4 sigma.
  double inlier_probability = 0.999;
  // Factor between two stages of the graduation. The literature has 1.4; on simulated surveys with
  // up to 70 % wrong closures 2, 4 and 10 gave the same answer, so this is the quick one.
  double graduation_step = 4.0;
  // Iterations of Ceres in the last stage; a survey takes 5 to 30.
  int max_iterations = 100;
  // A submap that comes without a usable dead-reckoning edge is tied to its predecessor by the
  // dead-reckoned poses with these: it may be anywhere near, but not nowhere. So is the first to
  // the map, where there are position fixes and nothing says how well the start is known.
  double unlinked_sigma_m = 100.0;
  double unlinked_sigma_yaw_rad = Deg2Rad(30.0);
};

}  // namespace seastitch
