#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/ids.hpp"
#include "mapper/noise/overlap_blocks.hpp"
#include "mapper/noise/overlap_likelihood.hpp"
#include "mapper/noise/variance_components.hpp"

namespace seastitch {

// Noise of an overlap's soundings.
struct SoundingScatter {
  double prior_variance = 0.0;     // scatter about the smooth seabed inside one submap [m2]
  double residual_variance = 0.0;  // from the height differences of the two, per sounding [m2]
  double degrees = 0.0;            // degrees of freedom of residual_variance
  double least_variance = 0.0;     // lower bound [m2]

  // Variance of a sounding of this pair: its own, and the survey's with the weight of ten degrees
  // of freedom.
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
  double altitude_m = 0.0;     // root of the sum of squares of both submaps' altitudes
  LikelihoodTable likelihood;  // BoundedLikelihood()
  // Parts of the covariance: the fixed one (prior of the height, relief finer than a cell), and one
  // for a unit of each source of error.
  SmallMatrix fixed;
  SmallMatrix white;  // soundings of variance 1 m2
  SmallMatrix correlated_error;
  SmallMatrix position_walk;
  SmallMatrix heading_walk;
  SmallMatrix jacobian;  // of the coordinates with respect to T_target_source (x, y, yaw)

  VarianceComponents registered_under;  // noise that the registration expected
  VarianceComponents stated_under;      // noise of the covariance that the graph has

  SmallMatrix CovarianceUnder(const VarianceComponents& components) const;
  // Inverse covariance of (x, y, yaw) of T_target_source, axes of the target.
  Eigen::Matrix3d InformationUnder(const VarianceComponents& components) const;
  // Noise to be used for the covariance of this closure, given the survey's estimate. Weights,
  // level and convergence of a registration depend on the noise that it expected. Where that was
  // more than four times the estimate, it is kept until the pair is registered again
  // (IsOutdated()).
  VarianceComponents Applicable(const VarianceComponents& survey) const;
  bool IsOutdated(const VarianceComponents& survey) const;
  // By how much the logarithm of a figure of the survey has to change at least before Applicable()
  // decides otherwise.
  double LogUntilOutdated(const VarianceComponents& survey) const;
};

// For a record on disk: every number, in one order: 707 with three known directions. FromNumbers()
// throws std::invalid_argument where they are no statistics.
std::vector<double> ToNumbers(const ClosureStatistics& statistics);
ClosureStatistics ClosureStatisticsFromNumbers(const std::vector<double>& numbers);

}  // namespace seastitch
