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

// Hypothesis of where the source lies on the target: pose, and a shift added to the source's
// heights after the prior's z_m [m, positive down].
struct Hypothesis {
  Pose2 T_target_source;
  double shift_m = 0.0;
};

// Noise of the heights that is expected before they are compared.
struct ExpectedNoise {
  VarianceComponents components;  // of the survey
  double scatter_m;   // of single soundings about the smooth seabed: RMS of both submaps' values
  double altitude_m;  // root of the sum of squares of both submaps' altitudes

  double SoundingVariance() const {
    return components.sounding_variance_ratio * scatter_m * scatter_m;
  }
  // Variance of the correlated height errors of neighbouring soundings: sum of both submaps.
  double SharedVariance() const {
    const double sigma_m = components.correlated_error_ratio * altitude_m;
    return sigma_m * sigma_m;
  }
};

// Information of an alignment about its pose, without the prior of x, y and yaw; z is marginalised
// (Schur complement) under its own prior. Parameters: position of `center_source` in the target
// [m], yaw [rad].
struct AlignmentInformation {
  // From products of one surface's slopes with the other's. Their noises are independent, so that
  // noise adds nothing to the mean: unbiased.
  Eigen::Matrix3d hessian;
  // What noise would add to a Hessian from the squared slopes of one surface.
  Eigen::Matrix3d noise_hessian;
  Eigen::Vector3d gradient;             // of the log-likelihood
  Eigen::Matrix3d gradient_covariance;  // of `gradient`, all sources of error together
  double sounding_sigma_m;
  double shared_sigma_m;
  double shift_sigma_m;

  // Parts of which gradient_covariance is made, with respect to (x, y, yaw, height).
  SoundingScatter scatter;
  std::vector<OverlapBlock> blocks;
  GradientCovariance sources;             // one per source of error, each for one unit of it
  Eigen::Matrix4d structure;              // covariance by seabed relief finer than a cell
  Eigen::Matrix<double, 3, 4> eliminate;  // matrix that marginalises the height
  double shift_information;               // of the prior of the height shift [1/m2]
  double shift_step_m;                    // Newton step of the height shift at this pose
};

// Hypothesis with the statistics of how the two surfaces fit there. Residual = source height
// (shifted by z_m and shift_m) - target height at the same place [m, positive down].
struct Alignment {
  Hypothesis at;
  double cells = 0.0;                // number of cells in the overlap
  double patches = 0.0;              // number of independent measurements: cells / (4 pi)
  double relief_variance = 0.0;      // variance of heights, sum of both surfaces [m2]
  double difference_variance = 0.0;  // of the residuals [m2]
  double expected_variance = 0.0;    // of the residuals, by sounding noise and shared errors [m2]
  double noise_scale = 1.0;          // mean squared residual divided by its expectation
  double log_prior = 0.0;            // log density of the prior at the hypothesis, up to a constant
  double evidence = 0.0;             // AgreementScore() (window_search.hpp) of DegreesOfFreedom()
  bool converged = false;
  std::optional<AlignmentInformation> information{};  // by GridAligner::Inform()

  double Score() const { return evidence + log_prior; }
  // Patches less the four parameters that were fitted to them.
  double DegreesOfFreedom() const { return std::max(0.0, patches - 4.0); }
  double EvidencePerPatch() const { return evidence / std::max(DegreesOfFreedom(), 1.0); }
};

// Aligns the source's cells of one level to the target's in x, y, yaw and height by Gauss-Newton;
// roll and pitch stay.
class GridAligner {
 public:
  // center_source: middle of the overlap in the source's level frame. Keeps references to target,
  // source and params, which must outlive it.
  GridAligner(const RegistrationSubmap::Level& target,
              const RegistrationSubmap::Level& source,
              const RegistrationPrior& prior,
              const ExpectedNoise& noise,
              const Eigen::Vector2d& center_source,
              const RegistrationParams& params);

  // Most probable hypothesis near `start`, prior included.
  Alignment Align(const Hypothesis& start) const;
  // Statistics at a hypothesis, without moving it. noise_scale: that of the alignment it comes
  // from; it scales the bound of Huber's weights.
  Alignment Evaluate(const Hypothesis& at, double noise_scale) const;
  // Information of an alignment about its pose (defined in fit_information.cpp).
  AlignmentInformation Inform(const Alignment& fit) const;

  // Middle of the overlap, axes of the target.
  Eigen::Vector2d Center(const Pose2& T_target_source) const {
    return T_target_source * center_source_;
  }
  // Jacobian of (position of the centre, yaw) with respect to (x, y, yaw) of T_target_source.
  Eigen::Matrix3d CenterJacobian(const Pose2& T_target_source) const;
  // Moves the centre and rotates about it: step in x, y [m, axes of the target's level frame], yaw
  // [rad], height shift [m].
  Hypothesis Moved(const Hypothesis& from, const Eigen::Vector4d& step) const;

 private:
  struct NormalEquations;
  template <class Visit>
  void ForEachCell(const Hypothesis& at, Visit visit) const;
  // Sums over the cells of the overlap. also(p, robust_weight, J, apart, pull) is called for each
  // CellPair p, with J its Jacobian row by the mean slope, apart = CellPair::RowsApart(), and pull
  // its weighted part of the gradient.
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
  double sounding_variance_;  // expected by `noise_` [m2]
  double shared_variance_;
  Eigen::Vector2d center_source_;
  const RegistrationParams& params_;
};

}  // namespace seastitch
