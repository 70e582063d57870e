#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

struct SearchMode {
  Pose2 T_target_source;
  double score = 0.0;  // log-likelihood ratio against a chance placement, prior included
};

// How well two surfaces agree over `patches` independent places, against two that have nothing to
// do with each other: patches / 2 * log(relief variance of both / variance of their difference).
// That is the mutual information of Gaussian heights: free of scale, and it rewards both a close
// fit and a large overlap.
double AgreementScore(double patches, double relief_variance, double difference_variance);

// Tries every place within the window of the prior on the cells of one level, each with the best
// constant height offset, by correlation through the Fourier transform. Returns the most prominent
// maxima, the best first.
std::vector<SearchMode> SearchWindow(const RegistrationSubmap::Level& target,
                                     const RegistrationSubmap::Level& source,
                                     const RegistrationPrior& prior,
                                     const RegistrationParams& params);

// Cells x yaw hypotheses that SearchWindow would transform.
double SearchCost(const RegistrationSubmap::Level& target,
                  const RegistrationSubmap::Level& source,
                  const RegistrationPrior& prior,
                  const RegistrationParams& params);

}  // namespace seastitch
