#pragma once

#include <vector>

#include "optimizer/solver/factor_graph.hpp"

namespace seastitch {

// Squared normalised innovation of a factor: the squared Mahalanobis distance between its
// measurement and the prediction by all other factors (Baarda's test). Where the model holds it is
// chi-square distributed with the rank of the factor's information.
// residual: W e. open: the residual's covariance as propagated from the vertices
// (GraphCovariance::of_residual). weight: the inlier weight with which the factor was used.
double NormalisedInnovation(const Eigen::Vector3d& residual,
                            const Eigen::Matrix3d& open,
                            double weight);

// A posteriori variance factor of dead reckoning, at least 1: by how much the squared errors of its
// steps exceed their stated covariance. innovations: NormalisedInnovation() of every factor of the
// graph; 1 where that is empty.
double VarianceFactor(const FactorGraph& graph, const std::vector<double>& innovations);

}  // namespace seastitch
