#pragma once

#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// Squared normalised innovation of a factor: the squared Mahalanobis distance of its measurement
// from the prediction of the graph without it (Baarda's test; chi-square of its rank where the
// model holds). Computed from its residual, the residual's covariance by the graph
// (GraphCovariance::of_residual) and its weight.
double NormalisedInnovation(const Eigen::Vector3d& residual,
                            const Eigen::Matrix3d& open,
                            double weight);

// A posteriori variance factor of dead reckoning, at least 1: mean squared error of its steps over
// their stated covariance, from the innovations of all factors. 1 without innovations.
double VarianceFactor(const FactorGraph& graph, const std::vector<double>& innovations);

}  // namespace seastitch
