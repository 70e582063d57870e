#pragma once

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <thread>
#include <utility>

#include "bench/terrain.hpp"
#include "mapper/registration/registration.hpp"
#include "tests/mapper/registration/synthetic_pair.hpp"

// Pairs of submaps and their priors, for the tests of the registration.
namespace seastitch {

struct Prior {
  Pose2 T_target_source;
  Eigen::Matrix3d covariance;
};

// Off by `offset_m` in a direction of its own and by `yaw_rad`, both at 2 sigma of what it claims.
inline Prior PriorAround(const Pose2& truth,
                         double offset_m,
                         double yaw_rad,
                         double direction_rad) {
  Prior prior{truth, Eigen::Matrix3d::Zero()};
  prior.T_target_source.x += offset_m * std::cos(direction_rad);
  prior.T_target_source.y += offset_m * std::sin(direction_rad);
  prior.T_target_source.yaw += yaw_rad;
  const double sigma = std::max(0.2, 0.5 * offset_m);
  const double sigma_yaw = std::max(0.005, 0.5 * std::abs(yaw_rad));
  prior.covariance.diagonal() << sigma * sigma, sigma * sigma, sigma_yaw * sigma_yaw;
  return prior;
}

inline RegistrationSubmap Prepare(const SyntheticSubmap& submap,
                                  const RegistrationParams& params = {}) {
  return RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params);
}

inline RegistrationResult RegisterPair(const SyntheticPair& pair,
                                       const Prior& prior,
                                       const RegistrationParams& params = {}) {
  return Align(Prepare(pair.target, params),
               Prepare(pair.source, params),
               {prior.T_target_source, prior.covariance, pair.z_prior_m, 0.5},
               params);
}

inline Eigen::Vector3d ErrorOf(const Pose2& estimate, const Pose2& truth) {
  Eigen::Vector3d e = estimate.Vector() - truth.Vector();
  e[2] = WrapAngle(e[2]);
  return e;
}

}  // namespace seastitch
