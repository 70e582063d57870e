#pragma once

#include <vector>

#include "optimizer/factor_graph.hpp"

namespace seastitch {

// The squared normalised innovation of a factor: the squared Mahalanobis distance of what it
// measures from what the graph without it predicts (Baarda's test; chi-square of its rank where the
// model holds). From its residual, what the graph leaves open of that (GraphCovariance) and its
// weight.
double NormalisedInnovation(const Eigen::Vector3d& residual,
                            const Eigen::Matrix3d& open,
                            double weight);

// The a posteriori variance factor of dead reckoning: by how much the squared errors of its steps
// exceed what it states; at least 1. From the innovations of all factors; 1 where there are
// none.
double VarianceFactor(const FactorGraph& graph, const std::vector<double>& innovations);

}  // namespace seastitch
