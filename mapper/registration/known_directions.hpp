#pragma once

#include <Eigen/Core>

#include "mapper/registration/grid_alignment.hpp"

namespace seastitch {

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 3, 1>;

// Observable ("known") directions of (position of the centre, yaw) of an alignment, and its
// covariance along them. A seabed without relief along a direction, such as that of a pipe, makes
// the direction unobservable ("open"). All in units of prior sigma.
struct KnownDirections {
  SmallMatrix directions;  // 3 x rank: unit vectors of whitened (position of the centre, yaw)
  SmallMatrix covariance;  // rank x rank: of the coordinates along them
  SmallMatrix gain;        // rank x 3: coordinates from a gradient
  Eigen::Matrix3d whiten;  // (position of the centre [m], yaw [rad]) to prior sigma

  int rank() const { return static_cast<int>(directions.cols()); }
  SmallVector Coordinates(const Eigen::Vector3d& centre_and_yaw) const {
    return directions.transpose() * (whiten * centre_and_yaw);
  }
  // Squared Mahalanobis distance of coordinates.
  double Chi2(const SmallVector& coordinates) const;
  // Information gained over the prior [nats].
  double Information() const;
};

// A direction is known where its eigenvalue of the Hessian exceeds params.min_slope_significance
// standard deviations of what noise alone would make of it.
KnownDirections KnownDirectionsOf(const GridAligner& aligner,
                                  const Alignment& fit,
                                  const AlignmentInformation& info,
                                  const RegistrationPrior& prior,
                                  const RegistrationParams& params);

}  // namespace seastitch
