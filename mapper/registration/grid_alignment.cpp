#include "mapper/registration/grid_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "mapper/registration/height_grid.hpp"
#include "mapper/registration/smoothing.hpp"

namespace seastitch {
namespace {

using Cell = RegistrationSubmap::Cell;

// Huber's bound in sigma: 1 % of Gaussian residuals are bounded, the pull of a wreck or a shoal of
// fish that only one submap saw no longer grows with its height.
constexpr double kHuberSigma = 2.5;
// Soundings of a cell that scatter by so many times the variance of the others do so because the
// seabed there is finer than the cell, a pipe or a wreck, and not by chance.
constexpr double kClearScatter = 4.0;
constexpr int kMaxSteps = 40;
constexpr double kStepToleranceCells = 1e-3;
// Steps of a tenth of a sigma change nothing that matters.
constexpr double kStepToleranceChi2 = 0.01;
// x, y, yaw and height are fitted to the means of the blocks before these are compared.
constexpr double kFittedParameters = 4.0;

const double kPatchCells = SmoothingKernel().PatchCells();

Eigen::Vector4d Row(const Eigen::Vector2d& slope, const Eigen::Vector2d& arm) {
  // Residual = source height + shift - target height; turning by dyaw moves arm by dyaw x arm.
  return {-slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x(), 1.0};
}

// One cell of the source over the target.
struct CellPair {
  int row;
  int col;
  CellsAround around;
  Eigen::Vector2d arm;  // from the source's centre, in the target's axes
  Eigen::Vector2d slope_target;
  Eigen::Vector2d slope_source;  // in the target's axes
  double height_target;
  double height_source;      // shifted
  double variance_both;      // of the residual, from soundings of unit variance where noise is 1
  double residual;           // [m]
  double expected_variance;  // of the residual [m2]
  double weight;             // inverse variance of an independent cell's share
  Eigen::Vector2d chance;    // mean of residual times slope that the noise of soundings makes [m]

  Eigen::Vector2d MeanSlope() const { return 0.5 * (slope_target + slope_source); }
  // The residual's part of the gradient, per weight. Where the soundings lie to one side of a cell,
  // at the rim of a submap, the errors of its height and of its slope are one error: left in, it
  // would pull every pair closer together. J: Row() of the mean slope.
  Eigen::Vector4d Pull(const Eigen::Vector4d& J) const {
    const Eigen::Vector4d by_chance(
        -chance.x(), -chance.y(), chance.x() * arm.y() - chance.y() * arm.x(), 0.0);
    return by_chance - residual * J;
  }
  // Row of the target less that of the source: of x, y and yaw, since they agree on the height.
  Eigen::Vector3d RowsApart() const {
    const Eigen::Vector2d slope = slope_target - slope_source;
    return {-slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x()};
  }
  double RobustWeight(double noise_scale) const {
    const double bound = kHuberSigma * kHuberSigma * noise_scale * expected_variance;
    return residual * residual <= bound ? 1.0 : std::sqrt(bound) / std::abs(residual);
  }
};

struct Moments {
  double weight = 0.0;
  double sum = 0.0;
  double square = 0.0;
  void Add(double w, double v) {
    weight += w;
    sum += w * v;
    square += w * v * v;
  }
  double Variance() const {
    return std::max(0.0, square / weight - (sum / weight) * (sum / weight));
  }
};

// The gradient as a measurement of how far the placement is off: its mean is `cross` times that,
// its covariance the one-sided Hessian `mean`, which holds what noise makes of the slopes too.
// Where these agree the measurement is Newton's step; where the slopes are noise alone it weighs
// nothing and the prior decides.
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

// The columns, of `cols` that begin at `start` and lie `step` apart, that come to lie on a grid,
// and at most one more on either side.
std::pair<int, int> ColumnsOver(const GridGeometry& g,
                                const Eigen::Vector2d& start,
                                const Eigen::Vector2d& step,
                                int cols) {
  const Eigen::Vector2d size = g.cell_m * Eigen::Vector2d(g.rows, g.cols);
  double first = 0.0;
  double last = cols - 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = g.origin[axis] - start[axis];
    const double high = low + size[axis];
    if (std::abs(step[axis]) < 1e-9 * g.cell_m) {
      if (low > 0.0 || high < 0.0) return {0, -1};
      continue;
    }
    const auto [near, far] = std::minmax({low / step[axis], high / step[axis]});
    first = std::max(first, std::floor(near));
    last = std::min(last, std::ceil(far));
  }
  if (!(first <= last)) return {0, -1};
  return {static_cast<int>(first), static_cast<int>(last)};
}

}  // namespace

struct GridAligner::Normal {
  Eigen::Matrix4d hessian_mean = Eigen::Matrix4d::Zero();
  Eigen::Matrix3d hessian_apart = Eigen::Matrix3d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  double cells = 0.0;
  double radius_m = 0.0;  // root mean square of the arms
  double noise_scale = 1.0;
  double expected_variance = 0.0;
  Moments target;
  Moments source;
  Moments difference;

  // Symmetric part of the rows of one surface times those of the other.
  Eigen::Matrix4d HessianCross() const {
    Eigen::Matrix4d cross = hessian_mean;
    cross.topLeftCorner<3, 3>() -= 0.25 * hessian_apart;
    return cross;
  }
};

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
      sounding_variance_(noise.sounding_sigma_m * noise.sounding_sigma_m),
      shared_variance_(noise.shared_sigma_m * noise.shared_sigma_m),
      center_source_(center_source),
      params_(params) {}

template <class Visit>
void GridAligner::ForEachCell(const Placement& at, Visit visit) const {
  const GridGeometry& g = source_.grid.geometry();
  const Eigen::Matrix2d R = at.T_target_source.Rotation();
  const Eigen::Vector2d center_target = at.T_target_source * center_source_;
  const double shift = prior_.source_shift_m + at.shift_m;
  const double patch_variance = sounding_variance_ / kPatchCells;
  HeightSample sample;
  CellPair pair;
  const Eigen::Vector2d along_row = R.col(1) * g.cell_m;
  for (pair.row = 0; pair.row < g.rows; ++pair.row) {
    const Eigen::Vector2d first_arm = R * (g.Center(pair.row, 0) - center_source_);
    const auto [first, last] =
        ColumnsOver(target_.grid.geometry(), center_target + first_arm, along_row, g.cols);
    for (pair.col = first; pair.col <= last; ++pair.col) {
      const Cell& cell = source_.grid(pair.row, pair.col);
      if (!(cell.variance > 0.0f)) continue;
      pair.arm = first_arm + pair.col * along_row;
      if (!Interpolate(target_.grid, center_target + pair.arm, &pair.around, &sample)) continue;
      pair.slope_target = sample.slope;
      pair.slope_source = R.col(0) * cell.slope_x + R.col(1) * cell.slope_y;
      pair.height_target = sample.height_m;
      pair.height_source = cell.height_m + shift;
      pair.variance_both = cell.variance + sample.variance;
      pair.residual = pair.height_source - pair.height_target;
      pair.expected_variance = patch_variance * pair.variance_both + shared_variance_;
      pair.weight = 1.0 / (kPatchCells * pair.expected_variance);
      pair.chance =
          0.5 * patch_variance *
          (R.col(0) * cell.covariance_x + R.col(1) * cell.covariance_y - sample.covariance);
      visit(pair);
    }
  }
}

GridAligner::Normal GridAligner::Linearize(const Placement& at, double noise_scale) const {
  Normal n;
  double arms = 0.0;
  double robust = 0.0;
  ForEachCell(at, [&](const CellPair& p) {
    const double psi = p.RobustWeight(noise_scale);
    const double w = p.weight * psi;
    const Eigen::Vector4d J = Row(p.MeanSlope(), p.arm);
    const Eigen::Vector3d apart = p.RowsApart();
    n.hessian_mean.noalias() += (w * J) * J.transpose();
    n.hessian_apart.noalias() += (w * apart) * apart.transpose();
    n.gradient += w * p.Pull(J);
    arms += p.arm.squaredNorm();
    robust += psi;
    n.cells += 1.0;
    n.target.Add(p.weight, p.height_target);
    n.source.Add(p.weight, p.height_source);
    n.difference.Add(w, p.residual);
  });
  if (n.cells == 0.0) return n;
  n.radius_m = std::sqrt(arms / n.cells);
  n.noise_scale = std::max(kPatchCells * n.difference.square / robust, 0.01);
  n.expected_variance = n.cells / (kPatchCells * n.target.weight);
  return n;
}

Eigen::Matrix3d GridAligner::CenterJacobian(const Pose2& T_target_source) const {
  const Eigen::Vector2d arm = T_target_source.Rotation() * center_source_;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J(0, 2) = -arm.y();
  J(1, 2) = arm.x();
  return J;
}

Placement GridAligner::Moved(const Placement& from, const Eigen::Vector4d& step) const {
  const Eigen::Vector2d center = from.T_target_source * center_source_ + step.head<2>();
  Placement to;
  to.T_target_source.yaw = WrapAngle(from.T_target_source.yaw + step[2]);
  const Eigen::Vector2d p = center - to.T_target_source.Rotation() * center_source_;
  to.T_target_source.x = p.x();
  to.T_target_source.y = p.y();
  to.shift_m = from.shift_m + step[3];
  return to;
}

Eigen::Vector3d GridAligner::PriorDeviation(const Placement& at) const {
  Eigen::Vector3d d = at.T_target_source.Vector() - prior_.T_target_source.Vector();
  d[2] = WrapAngle(d[2]);
  return d;
}

Fit GridAligner::Summary(const Placement& at, const Normal& n) const {
  Fit fit;
  fit.at = at;
  fit.cells = n.cells;
  fit.patches = n.cells / kPatchCells;
  if (n.cells == 0.0) return fit;
  fit.noise_scale = n.noise_scale;
  fit.relief_variance = n.target.Variance() + n.source.Variance();
  fit.difference_variance = n.difference.Variance();
  fit.expected_variance = n.expected_variance;
  const Eigen::Vector3d deviation = PriorDeviation(at);
  const double shift = at.shift_m / prior_.source_shift_sigma_m;
  fit.log_prior = -0.5 * (deviation.dot(prior_information_ * deviation) + shift * shift);
  const double floor = params_.min_sounding_sigma_m * params_.min_sounding_sigma_m / kPatchCells;
  fit.evidence =
      AgreementScore(fit.Witnesses(), fit.relief_variance + floor, fit.difference_variance + floor);
  return fit;
}

Fit GridAligner::Describe(const Placement& at, double noise_scale) const {
  return Summary(at, Linearize(at, noise_scale));
}

Fit GridAligner::Align(const Placement& start) const {
  const double shift_information =
      1.0 / (prior_.source_shift_sigma_m * prior_.source_shift_sigma_m);
  Placement at = start;
  double noise_scale = std::numeric_limits<double>::infinity();  // the first step bounds nothing
  double damping = 1.0;
  Eigen::Vector4d last_lengths = Eigen::Vector4d::Zero();
  for (int i = 0;; ++i) {
    const Normal n = Linearize(at, noise_scale);
    Fit fit = Summary(at, n);
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

    // Cells at the rim enter and leave with every step; a step that turns back is part of a cycle.
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
    // On a slope the height belongs to the position: it is solved anew for the damped step.
    step[3] = (b[3] - H.row(3).head<3>().dot(step.head<3>())) / H(3, 3);
    at = Moved(at, step);
  }
}

namespace {

// What a unit error of each cell's height adds to the gradient, over one of the two submaps.
class Shares {
 public:
  explicit Shares(const Grid<Cell>& grid)
      : grid_(grid), shares_(grid.geometry().size(), Share::Zero()) {
    columns_.resize(static_cast<std::size_t>(grid.geometry().rows));
  }

  // share: what an error of unit variance would add.
  void Add(int row, int col, const Eigen::Array4f& share) {
    const std::size_t i = grid_.geometry().Index(row, col);
    const Cell& cell = grid_.cells()[i];
    shares_[i] += share * (cell.variance / cell.noise);
    ColumnSpan& columns = columns_[static_cast<std::size_t>(row)];
    columns = columns.Union({col, col + 1});
  }

  // Sum over soundings of n variance u u^T, where u is what a sounding of unit error in a cell adds
  // to the gradient: the shares of the cells, smoothed as the heights were. The variance is
  // `variance` times the noise there, or what the cell shows where that is clearly more.
  Eigen::Matrix4d OfSoundings(double variance) const {
    const GridGeometry& g = grid_.geometry();
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    const auto load = [&](int row, Share* line) {
      const ColumnSpan columns = columns_[static_cast<std::size_t>(row)];
      for (int col = columns.first; col < columns.last; ++col)
        line[col] = shares_[g.Index(row, col)];
      return columns;
    };
    SmoothRows<Share>(g.rows, g.cols, load, [&](int row, ColumnSpan columns, const Share* line) {
      for (int col = columns.first; col < columns.last; ++col) {
        const Cell& cell = grid_(row, col);
        if (cell.soundings == 0.0f) continue;
        const double shown = static_cast<double>(cell.scatter);
        const double expected = variance * static_cast<double>(cell.noise);
        const double sounding_variance = shown > kClearScatter * expected ? shown : expected;
        const Eigen::Vector4d u = line[col].matrix().cast<double>();
        sum.noalias() += (cell.soundings * sounding_variance * u) * u.transpose();
      }
    });
    return sum;
  }

 private:
  using Share = Eigen::Array4f;
  const Grid<Cell>& grid_;
  std::vector<Share> shares_;
  std::vector<ColumnSpan> columns_;
};

// The cells of one block of the overlap, within which errors are shared.
struct Block {
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();  // sum of weighted rows
  Moments residuals;                               // by inverse variance
  double cells = 0.0;
};

}  // namespace

FitInformation GridAligner::Inform(const Fit& fit) const {
  const double block_m =
      std::max(params_.error_correlation_length_m, 3.0 * std::sqrt(kPatchCells) * source_.cell_m());
  std::map<std::pair<int, int>, Block> blocks;
  std::pair<int, int> last_key;
  Block* last = nullptr;  // of `last_key`: most cells lie in the block of the one before
  Eigen::Matrix4d hessian_mean = Eigen::Matrix4d::Zero();
  Eigen::Matrix3d hessian_apart = Eigen::Matrix3d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  Shares source_shares(source_.grid);
  Shares target_shares(target_.grid);
  ForEachCell(fit.at, [&](const CellPair& p) {
    const double psi = p.RobustWeight(fit.noise_scale);
    const double w = p.weight * psi;
    const Eigen::Vector4d J = Row(p.MeanSlope(), p.arm);
    const Eigen::Vector3d apart = p.RowsApart();
    const Eigen::Vector4d pull = w * J;
    hessian_mean.noalias() += pull * J.transpose();
    hessian_apart.noalias() += (w * apart) * apart.transpose();
    gradient += w * p.Pull(J);
    const std::pair<int, int> here{static_cast<int>(std::floor(p.arm.x() / block_m)),
                                   static_cast<int>(std::floor(p.arm.y() / block_m))};
    if (last == nullptr || here != last_key) last = &blocks[last_key = here];
    last->pull += pull;
    last->residuals.Add(psi / p.variance_both, p.residual);
    last->cells += 1.0;
    const Eigen::Array4f share = pull.cast<float>().array();
    source_shares.Add(p.row, p.col, share);
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        target_shares.Add(
            p.around.row + i, p.around.col + j, share * static_cast<float>(p.around.Part(i, j)));
  });

  // Noise of soundings: what is left within the blocks. Shared errors: how their means differ by
  // more than that.
  double within = 0.0;
  double degrees = 0.0;
  for (const auto& [key, block] : blocks) {
    if (block.cells < 2.0 * kPatchCells) continue;
    within += block.residuals.weight * block.residuals.Variance();
    degrees += (block.cells - kPatchCells) / kPatchCells;
  }
  // Ten patches' worth of belief in the scatter of the soundings themselves.
  constexpr double kBelief = 10.0;
  const double sounding_variance =
      std::max((within + kBelief * sounding_variance_) / (degrees + kBelief),
               params_.min_sounding_sigma_m * params_.min_sounding_sigma_m);
  double excess = 0.0;
  double weight = 0.0;
  double count = 0.0;
  for (const auto& [key, block] : blocks) {
    if (block.cells < 2.0 * kPatchCells) continue;
    const double mean = block.residuals.sum / block.residuals.weight;
    excess += block.residuals.weight * mean * mean - sounding_variance;
    weight += block.residuals.weight;
    count += 1.0;
  }
  double shared_variance = shared_variance_;
  if (count > kFittedParameters + 2.0)
    shared_variance =
        std::max(shared_variance, excess / weight * count / (count - kFittedParameters));

  Eigen::Matrix4d B =
      source_shares.OfSoundings(sounding_variance) + target_shares.OfSoundings(sounding_variance);
  for (const auto& [key, block] : blocks)
    B.noalias() += shared_variance * block.pull * block.pull.transpose();
  const double shift_information =
      1.0 / (prior_.source_shift_sigma_m * prior_.source_shift_sigma_m);
  B(3, 3) += shift_information;
  Eigen::Matrix4d cross = hessian_mean;
  cross.topLeftCorner<3, 3>() -= 0.25 * hessian_apart;
  cross(3, 3) += shift_information;
  gradient[3] -= shift_information * fit.at.shift_m;

  Eigen::Matrix<double, 3, 4> eliminate = Eigen::Matrix<double, 3, 4>::Identity();
  eliminate.col(3) = -cross.topRightCorner<3, 1>() / cross(3, 3);
  FitInformation out;
  out.hessian = (eliminate * cross).leftCols<3>();
  out.noise_hessian = 0.5 * hessian_apart;
  out.gradient = eliminate * gradient;
  out.gradient_covariance = eliminate * B * eliminate.transpose();
  out.sounding_sigma_m = std::sqrt(sounding_variance);
  out.shared_sigma_m = std::sqrt(shared_variance);
  out.shift_sigma_m = std::sqrt(B(3, 3)) / cross(3, 3);
  return out;
}

}  // namespace seastitch
