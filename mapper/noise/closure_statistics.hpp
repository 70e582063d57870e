#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/ids.hpp"
#include "mapper/noise/overlap_blocks.hpp"
#include "mapper/noise/overlap_likelihood.hpp"
#include "mapper/noise/variance_components.hpp"

namespace seastitch {

// How noisy an overlap's soundings are.
struct SoundingScatter {
  double prior_variance = 0.0;     // about the smooth seabed, of a submap alone [m2]
  double residual_variance = 0.0;  // what is left between the two, a sounding [m2]
  double degrees = 0.0;            // of freedom of that
  double least_variance = 0.0;     // lower bound [m2]

  // Of a sounding of this pair: ten degrees of freedom's worth of belief in the survey's.
  double VarianceUnder(const VarianceComponents& components) const;
};

// Statistics of an accepted closure, 3.5 kB: the likelihood of the survey's noise by its overlap,
// and the parts of its covariance, so that the covariance can be computed again for another noise.
// Coordinates are along the known directions, one to three.
struct ClosureStatistics {
  using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;

  SubmapId target;
  SubmapId source;
  SoundingScatter scatter;
  double altitude_m = 0.0;     // hypotenuse of those of both submaps
  LikelihoodTable likelihood;  // BoundedLikelihood()
  // Covariance: what depends on no component (the prior of the height, seabed finer than a cell),
  // and one unit of each source of error.
  SmallMatrix fixed;
  SmallMatrix white;  // soundings of variance 1 m2
  SmallMatrix correlated_error;
  SmallMatrix position_walk;
  SmallMatrix heading_walk;
  SmallMatrix jacobian;  // of the coordinates by T_target_source (x, y, yaw)

  VarianceComponents registered_under;
  VarianceComponents stated_under;  // that the graph has

  SmallMatrix CovarianceUnder(const VarianceComponents& components) const;
  // Inverse covariance of (x, y, yaw) of T_target_source, axes of the target.
  Eigen::Matrix3d InformationUnder(const VarianceComponents& components) const;
  // Noise for the covariance of this closure where `survey` is the estimate. Weights, level and
  // convergence of a registration depend on the noise that it expected: where that was more than
  // four times too large, the larger is kept until the pair is registered again.
  VarianceComponents Applicable(const VarianceComponents& survey) const;
  bool IsOutdated(const VarianceComponents& survey) const;
};

// For a record on disk: every number, in one order, 700 of them. FromNumbers() throws
// std::invalid_argument where they are no statistics.
std::vector<double> ToNumbers(const ClosureStatistics& statistics);
ClosureStatistics ClosureStatisticsFromNumbers(const std::vector<double>& numbers);

}  // namespace seastitch
