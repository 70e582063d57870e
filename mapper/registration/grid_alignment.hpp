#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/noise/closure_statistics.hpp"
#include "mapper/noise/overlap_blocks.hpp"
#include "mapper/noise/variance_components.hpp"
#include "mapper/registration/registration.hpp"
#include "mapper/registration/window_search.hpp"

namespace seastitch {

// A hypothesis of where the source lies: its pose, and what is added to its heights beyond the
// prior's z_m.
struct Hypothesis {
  Pose2 T_target_source;
  double shift_m = 0.0;
};

// Noise that is expected of the heights before they are compared.
struct ExpectedNoise {
  VarianceComponents components;  // of the survey
  double scatter_m;               // of single soundings about the smooth seabed, of one submap
  double altitude_m;              // hypotenuse of those of both

  double SoundingVariance() const {
    return components.sounding_variance_ratio * scatter_m * scatter_m;
  }
  // Of the errors that neighbouring soundings share, of both submaps together.
  double SharedVariance() const {
    const double sigma_m = components.correlated_error_ratio * altitude_m;
    return sigma_m * sigma_m;
  }
};

// Information of an alignment about its pose, without the prior of x, y and yaw; z is eliminated
// under its own prior. Parameters: position in the target of `center_source` [m], yaw [rad].
struct AlignmentInformation {
  Eigen::Matrix3d hessian;        // slopes of one surface times those of the other: unbiased
  Eigen::Matrix3d noise_hessian;  // part of a one-sided Hessian that noise alone makes
  Eigen::Vector3d gradient;       // of the log-likelihood
  Eigen::Matrix3d gradient_covariance;
  double sounding_sigma_m;
  double shared_sigma_m;
  double shift_sigma_m;

  // Parts of the covariance.
  SoundingScatter scatter;
  std::vector<OverlapBlock> blocks;
  GradientCovariance sources;             // of the gradient by (x, y, yaw, height)
  Eigen::Matrix4d structure;              // the same, by seabed that is finer than a cell
  Eigen::Matrix<double, 3, 4> eliminate;  // the height
  double shift_information;               // of its prior
};

// A hypothesis and the statistics of how the two surfaces fit there. Residual = source height -
// target height at the same place.
struct Alignment {
  Hypothesis at;
  double cells = 0.0;                // of the overlap
  double patches = 0.0;              // independent ones among them
  double relief_variance = 0.0;      // of both surfaces [m2]
  double difference_variance = 0.0;  // of the residuals [m2]
  double expected_variance = 0.0;    // of the residuals, by sounding noise and shared errors [m2]
  double noise_scale = 1.0;          // mean squared residual over its expectation
  double log_prior = 0.0;
  double evidence = 0.0;  // AgreementScore() of DegreesOfFreedom() patches
  bool converged = false;
  std::optional<AlignmentInformation> information{};  // by GridAligner::Inform()

  double Score() const { return evidence + log_prior; }
  // Patches less the four parameters that were fitted to them.
  double DegreesOfFreedom() const { return std::max(0.0, patches - 4.0); }
  double EvidencePerPatch() const { return evidence / std::max(DegreesOfFreedom(), 1.0); }
};

// Aligns the source's cells of one level to the target's in x, y, yaw and height, tilt untouched.
class GridAligner {
 public:
  // center_source: middle of the overlap.
  GridAligner(const RegistrationSubmap::Level& target,
              const RegistrationSubmap::Level& source,
              const RegistrationPrior& prior,
              const ExpectedNoise& noise,
              const Eigen::Vector2d& center_source,
              const RegistrationParams& params);

  // Most probable hypothesis near `start`, prior included.
  Alignment Align(const Hypothesis& start) const;
  // The alignment of a hypothesis as it is.
  Alignment Evaluate(const Hypothesis& at, double noise_scale) const;
  AlignmentInformation Inform(const Alignment& fit) const;  // fit_information.cpp

  // Middle of the overlap, axes of the target.
  Eigen::Vector2d Center(const Pose2& T_target_source) const {
    return T_target_source * center_source_;
  }
  // Jacobian of (position of the centre, yaw) with respect to (x, y, yaw) of T_target_source.
  Eigen::Matrix3d CenterJacobian(const Pose2& T_target_source) const;
  // Moves the centre and turns about it: step in x, y [m], yaw [rad], shift [m].
  Hypothesis Moved(const Hypothesis& from, const Eigen::Vector4d& step) const;

 private:
  struct NormalEquations;
  template <class Visit>
  void ForEachCell(const Hypothesis& at, Visit visit) const;
  // Sums over the cells of the overlap; also(p, robust_weight, J, apart, pull) is called for each.
  template <class Also>
  NormalEquations Accumulate(const Hypothesis& at, double noise_scale, Also also) const;
  NormalEquations Linearize(const Hypothesis& at, double noise_scale) const;
  Alignment Summary(const Hypothesis& at, const NormalEquations& normal) const;
  Eigen::Vector3d PriorDeviation(const Hypothesis& at) const;

  const RegistrationSubmap::Level& target_;
  const RegistrationSubmap::Level& source_;
  RegistrationPrior prior_;
  Eigen::Matrix3d prior_information_;
  ExpectedNoise noise_;
  double sounding_variance_;  // as expected of `noise_`
  double shared_variance_;
  Eigen::Vector2d center_source_;
  const RegistrationParams& params_;
};

}  // namespace seastitch
