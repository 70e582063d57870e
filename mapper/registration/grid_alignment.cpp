#include "mapper/registration/grid_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mapper/registration/cell_pairs.hpp"

namespace seastitch {
namespace {

constexpr int kMaxSteps = 40;
constexpr double kStepToleranceCells = 1e-3;
// A step below a tenth of a sigma is negligible.
constexpr double kStepToleranceChi2 = 0.01;

// The gradient as a measurement of the hypothesis's error: its mean is `cross` times the error, its
// covariance the one-sided Hessian `mean`, which includes the slopes that are only noise. If both
// matrices agree, the measurement gives Newton's step. If the slopes are only noise, it has no
// weight, and the prior decides.
struct Measurement {
  Eigen::Matrix4d information;
  Eigen::Vector4d pull;
};

Measurement Weigh(const Eigen::Matrix4d& cross,
                  const Eigen::Matrix4d& mean,
                  const Eigen::Vector4d& gradient) {
  const Eigen::LLT<Eigen::Matrix4d> llt(mean + 1e-12 * mean.trace() * Eigen::Matrix4d::Identity());
  const Eigen::Matrix4d half = llt.matrixL().solve(cross);
  const Eigen::Matrix4d ratio = llt.matrixL().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(ratio);
  const Eigen::Vector4d share = eigen.eigenvalues().cwiseMax(0.0).cwiseMin(1.0);
  const Eigen::Matrix4d L = llt.matrixL();
  const Eigen::Matrix4d V = L * eigen.eigenvectors() * share.asDiagonal();
  return {V * V.transpose(),
          V * (eigen.eigenvectors().transpose() * llt.matrixL().solve(gradient))};
}

}  // namespace

GridAligner::GridAligner(const RegistrationSubmap::Level& target,
                         const RegistrationSubmap::Level& source,
                         const RegistrationPrior& prior,
                         const ExpectedNoise& noise,
                         const Eigen::Vector2d& center_source,
                         const RegistrationParams& params)
    : target_(target),
      source_(source),
      prior_(prior),
      prior_information_(prior.covariance.inverse()),
      noise_(noise),
      sounding_variance_(std::max(noise.SoundingVariance(),
                                  params.min_sounding_sigma_m * params.min_sounding_sigma_m)),
      shared_variance_(noise.SharedVariance()),
      center_source_(center_source),
      params_(params) {}

GridAligner::NormalEquations GridAligner::Linearize(const Hypothesis& at,
                                                    double noise_scale) const {
  return Accumulate(at, noise_scale, [](const auto&...) {});
}

Eigen::Matrix3d GridAligner::CenterJacobian(const Pose2& T_target_source) const {
  const Eigen::Vector2d arm = T_target_source.Rotation() * center_source_;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J(0, 2) = -arm.y();
  J(1, 2) = arm.x();
  return J;
}

Hypothesis GridAligner::Moved(const Hypothesis& from, const Eigen::Vector4d& step) const {
  const Eigen::Vector2d center = from.T_target_source * center_source_ + step.head<2>();
  Hypothesis to;
  to.T_target_source.yaw = WrapAngle(from.T_target_source.yaw + step[2]);
  const Eigen::Vector2d p = center - to.T_target_source.Rotation() * center_source_;
  to.T_target_source.x = p.x();
  to.T_target_source.y = p.y();
  to.shift_m = from.shift_m + step[3];
  return to;
}

Eigen::Vector3d GridAligner::PriorDeviation(const Hypothesis& at) const {
  Eigen::Vector3d d = at.T_target_source.Vector() - prior_.T_target_source.Vector();
  d[2] = WrapAngle(d[2]);
  return d;
}

Alignment GridAligner::Summary(const Hypothesis& at, const NormalEquations& n) const {
  Alignment fit;
  fit.at = at;
  fit.cells = n.cells;
  fit.patches = n.cells / kPatchCells;
  if (n.cells == 0.0) return fit;
  fit.noise_scale = n.noise_scale;
  fit.relief_variance = n.target.Variance() + n.source.Variance();
  fit.difference_variance = n.difference.Variance();
  fit.expected_variance = n.expected_variance;
  const Eigen::Vector3d deviation = PriorDeviation(at);
  const double shift = at.shift_m / prior_.z_sigma_m;
  fit.log_prior = -0.5 * (deviation.dot(prior_information_ * deviation) + shift * shift);
  const double floor = params_.min_sounding_sigma_m * params_.min_sounding_sigma_m / kPatchCells;
  fit.evidence = AgreementScore(
      fit.DegreesOfFreedom(), fit.relief_variance + floor, fit.difference_variance + floor);
  return fit;
}

Alignment GridAligner::Evaluate(const Hypothesis& at, double noise_scale) const {
  return Summary(at, Linearize(at, noise_scale));
}

Alignment GridAligner::Align(const Hypothesis& start) const {
  const double shift_information = 1.0 / (prior_.z_sigma_m * prior_.z_sigma_m);
  Hypothesis at = start;
  double noise_scale = std::numeric_limits<double>::infinity();  // the first step is not bounded
  double damping = 1.0;
  Eigen::Vector4d last_lengths = Eigen::Vector4d::Zero();
  for (int i = 0;; ++i) {
    const NormalEquations n = Linearize(at, noise_scale);
    Alignment fit = Summary(at, n);
    if (!(fit.patches >= 1.0) || i == kMaxSteps) return fit;
    noise_scale = n.noise_scale;

    const Eigen::Matrix3d to_pose = CenterJacobian(at.T_target_source).inverse();
    const Measurement measured = Weigh(n.HessianCross(), n.hessian_mean, n.gradient);
    Eigen::Matrix4d H = measured.information / noise_scale;
    Eigen::Vector4d b = measured.pull / noise_scale;
    H.topLeftCorner<3, 3>() += to_pose.transpose() * prior_information_ * to_pose;
    b.head<3>() -= to_pose.transpose() * prior_information_ * PriorDeviation(at);
    H(3, 3) += shift_information;
    b[3] -= shift_information * at.shift_m;
    Eigen::Vector4d step = H.ldlt().solve(b);

    // Cells at the rim enter and leave with every step. A step back shows a cycle and is damped.
    const double cell = source_.cell_m();
    const Eigen::Vector4d lengths =
        step.cwiseProduct(Eigen::Vector4d(1.0, 1.0, std::max(n.radius_m, cell), 0.0));
    const double length = lengths.norm();
    if (!std::isfinite(length)) return fit;
    fit.converged = length < kStepToleranceCells * cell || step.dot(H * step) < kStepToleranceChi2;
    if (fit.converged) return fit;
    if (lengths.dot(last_lengths) < 0.0) damping = std::max(0.2, 0.7 * damping);
    last_lengths = lengths;
    step.head<3>() *= std::min(damping, cell / length);
    // On a slope the height depends on the position: solved again for the damped step.
    step[3] = (b[3] - H.row(3).head<3>().dot(step.head<3>())) / H(3, 3);
    at = Moved(at, step);
  }
}

}  // namespace seastitch
