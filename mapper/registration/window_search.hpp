#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

struct SearchMode {
  Pose2 T_target_source;
  double score = 0.0;  // log-likelihood ratio against chance plus log prior [nats]
};

// Log-likelihood ratio [nats] of two surfaces that agree against two independent ones, over
// `patches` independent places: patches / 2 * log(relief variance of both / variance of their
// difference). It is the mutual information of Gaussian heights: free of scale, larger for a closer
// fit and for a larger overlap.
double AgreementScore(double patches, double relief_variance, double difference_variance);

// Scores every hypothesis within the window of the prior on the cells of one level, each with its
// best constant height offset, by correlation through the Fourier transform. Returns the max_modes
// maxima of highest prominence (drop of the score to the saddle towards a higher maximum), sorted
// by score, best first.
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
