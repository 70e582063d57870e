#include "mapper/noise/overlap_likelihood.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

namespace seastitch {
namespace {

// Four parameters are fitted; six blocks leave 14 degrees of freedom.
constexpr std::size_t kFewestBlocks = 6;
// Fewest cells for which the sum of a block is approximately normal.
constexpr double kFewestCells = 12.0;

constexpr std::size_t kCoarse = 4;      // nodes along the axis of a walk
constexpr std::size_t kCoarseStep = 2;  // steps of the axis between nodes
static_assert(kPositionWalkAxis.size == kCoarseStep * (kCoarse - 1) + 1);
static_assert(kHeadingWalkAxis.size == kCoarseStep * (kCoarse - 1) + 1);

double LogDeterminant(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

// The sums of an overlap, whitened by their white noise.
struct Whitened {
  Eigen::MatrixXd sensitivity_and_gradient;  // 3 blocks x (4 + 1)
  Eigen::MatrixXd heights;  // 3 blocks x blocks; times its transpose: covariance for errors of 1 m
  Eigen::MatrixXd position_walk;  // covariance of 1 m/sqrt(m)
  Eigen::MatrixXd heading_walk;   // covariance of 1 rad/sqrt(m)
};

// Nothing if a block has no white noise, which does not occur.
std::optional<Whitened> Whiten(const std::vector<OverlapBlock>& blocks,
                               const Eigen::Matrix2d& R_target_source) {
  const auto n = static_cast<Eigen::Index>(blocks.size());
  const auto at = [&](Eigen::Index i) -> const OverlapBlock& {
    return blocks[static_cast<std::size_t>(i)];
  };
  Whitened w;
  w.sensitivity_and_gradient.resize(3 * n, 5);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::LLT<Eigen::Matrix3d> llt(at(i).white);
    if (llt.info() != Eigen::Success) return std::nullopt;
    Eigen::Matrix<double, 3, 5> rows;
    rows << at(i).hessian, at(i).gradient;
    w.sensitivity_and_gradient.middleRows<3>(3 * i) = llt.matrixL().solve(rows);
  }
  if (!w.sensitivity_and_gradient.allFinite()) return std::nullopt;

  Eigen::MatrixXd correlation(n, n);
  w.position_walk.resize(3 * n, 3 * n);
  w.heading_walk.resize(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Matrix<double, 3, 2> a = w.sensitivity_and_gradient.block<3, 2>(3 * i, 0);
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::Matrix<double, 3, 2> b = w.sensitivity_and_gradient.block<3, 2>(3 * j, 0);
      correlation(i, j) = correlation(j, i) = HeightErrorCorrelation(at(i), at(j));
      w.position_walk.block<3, 3>(3 * i, 3 * j) =
          PositionWalkCovariance(at(i), at(j)) * a * b.transpose();
      w.heading_walk.block<3, 3>(3 * i, 3 * j) =
          a * HeadingWalkCovariance(at(i), at(j), R_target_source) * b.transpose();
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> root(correlation);
  if (root.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd L = root.matrixL();
  w.heights.resize(3 * n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    w.heights.middleRows<3>(3 * i).noalias() =
        w.sensitivity_and_gradient.block<3, 1>(3 * i, 3) * L.row(i);
  return w;
}

// -2 ln L for every value of the correlated height error, for given walks. With the covariance of
// noise and walks factored, the height error only enters through eigenvalues.
std::array<double, kErrorRatioAxis.size> AlongErrorRatio(const Whitened& w,
                                                         double position_walk,
                                                         double heading_walk,
                                                         double altitude_m) {
  Eigen::MatrixXd C = position_walk * position_walk * w.position_walk +
                      heading_walk * heading_walk * w.heading_walk;
  C.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> llt(C);  // uses the lower half only
  const Eigen::MatrixXd X = llt.matrixL().solve(w.sensitivity_and_gradient);
  const Eigen::MatrixXd F = llt.matrixL().solve(w.heights);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(F.transpose() * F);
  const Eigen::VectorXd lambda = eigen.eigenvalues().cwiseMax(0.0);
  const Eigen::MatrixXd Y = eigen.eigenvectors().transpose() * (F.transpose() * X);
  const Eigen::Matrix<double, 5, 5> without = X.transpose() * X;
  const double log_determinant = LogDeterminant(llt);
  std::array<double, kErrorRatioAxis.size> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double variance = std::pow(kErrorRatioAxis.At(i) * altitude_m, 2);
    const Eigen::VectorXd inflated = (1.0 + variance * lambda.array()).matrix();
    const Eigen::VectorXd part = variance * inflated.cwiseInverse();
    const Eigen::Matrix<double, 5, 5> S = without - Y.transpose() * part.asDiagonal() * Y;
    Eigen::Matrix4d H = S.topLeftCorner<4, 4>();
    H.diagonal() *= 1.0 + 1e-9;  // for directions without information in this overlap
    const Eigen::LDLT<Eigen::Matrix4d> of_H(H);
    const Eigen::Vector4d b = S.topRightCorner<4, 1>();
    values[i] = log_determinant + inflated.array().log().sum() +
                of_H.vectorD().cwiseMax(1e-300).array().log().sum() + S(4, 4) -
                b.dot(of_H.solve(b));
  }
  return values;
}

// Weights of the cubic through the four nodes, which are two steps apart, at step i.
std::array<double, kCoarse> CubicWeights(std::size_t i) {
  std::array<double, kCoarse> weights{};
  const double x = static_cast<double>(i) / static_cast<double>(kCoarseStep);
  for (std::size_t k = 0; k < kCoarse; ++k) {
    weights[k] = 1.0;
    for (std::size_t j = 0; j < kCoarse; ++j)
      if (j != k)
        weights[k] *=
            (x - static_cast<double>(j)) / (static_cast<double>(k) - static_cast<double>(j));
  }
  return weights;
}

// Distribution of a pair's component: log-normal about the survey's value, with a fraction
// kOutliers of outliers.
constexpr double kSpread = 0.5;  // sigma of the natural logarithm
constexpr double kOutliers = 0.1;

// Replaces the likelihood of a pair's own component (axis i) by that of the survey's component (j),
// with the distribution above.
void Blur(const ComponentAxis& axis, std::size_t stride, std::vector<double>* density) {
  const std::size_t n = axis.size;
  std::vector<double> kernel(n * n);  // one row per value of the survey's component
  for (std::size_t j = 0; j < n; ++j) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double apart = std::log(axis.At(i) / axis.At(j)) / kSpread;
      sum += kernel[j * n + i] = std::exp(-0.5 * apart * apart);
    }
    for (std::size_t i = 0; i < n; ++i)
      kernel[j * n + i] =
          (1.0 - kOutliers) * kernel[j * n + i] / sum + kOutliers / static_cast<double>(n);
  }
  std::vector<double> line(n);
  for (std::size_t first = 0; first < density->size(); ++first) {
    if ((first / stride) % n != 0) continue;
    for (std::size_t i = 0; i < n; ++i) line[i] = (*density)[first + i * stride];
    for (std::size_t j = 0; j < n; ++j) {
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i) sum += kernel[j * n + i] * line[i];
      (*density)[first + j * stride] = sum;
    }
  }
}

}  // namespace

double ComponentAxis::At(std::size_t i) const { return std::ldexp(first, static_cast<int>(i)); }

LikelihoodTable RestrictedLikelihood(const std::vector<OverlapBlock>& blocks,
                                     const Eigen::Matrix2d& R_target_source,
                                     double altitude_m) {
  LikelihoodTable table;
  std::vector<OverlapBlock> used;
  for (const OverlapBlock& block : blocks)
    if (block.cells >= kFewestCells) used.push_back(block);
  if (used.size() < kFewestBlocks) return table;
  const std::optional<Whitened> whitened = Whiten(used, R_target_source);
  if (!whitened) return table;

  std::array<std::array<std::array<double, kErrorRatioAxis.size>, kCoarse>, kCoarse> nodes{};
  for (std::size_t q = 0; q < kCoarse; ++q)
    for (std::size_t p = 0; p < kCoarse; ++p)
      nodes[q][p] = AlongErrorRatio(*whitened,
                                    kPositionWalkAxis.At(kCoarseStep * q),
                                    kHeadingWalkAxis.At(kCoarseStep * p),
                                    altitude_m);
  const double reference = nodes[0][0][0];  // subtracted: float is exact enough for differences
  for (std::size_t q = 0; q < kPositionWalkAxis.size; ++q) {
    const auto by_q = CubicWeights(q);
    for (std::size_t p = 0; p < kHeadingWalkAxis.size; ++p) {
      const auto by_p = CubicWeights(p);
      for (std::size_t s = 0; s < kErrorRatioAxis.size; ++s) {
        double value = 0.0;
        for (std::size_t i = 0; i < kCoarse; ++i)
          for (std::size_t j = 0; j < kCoarse; ++j)
            value += by_q[i] * by_p[j] * (nodes[i][j][s] - reference);
        if (!std::isfinite(value)) return {};
        table.Set(s, q, p, value);
      }
    }
  }
  return table;
}

LikelihoodTable BoundedLikelihood(const LikelihoodTable& likelihood) {
  const auto& values = likelihood.values();
  const double least = *std::min_element(values.begin(), values.end());
  std::vector<double> density(values.size());
  std::transform(values.begin(), values.end(), density.begin(), [least](double value) {
    return std::exp(-0.5 * (value - least));
  });
  const std::size_t p = kHeadingWalkAxis.size;
  const std::size_t q = kPositionWalkAxis.size;
  Blur(kErrorRatioAxis, q * p, &density);
  Blur(kPositionWalkAxis, p, &density);
  Blur(kHeadingWalkAxis, 1, &density);
  LikelihoodTable bounded;
  std::transform(density.begin(), density.end(), bounded.values().begin(), [](double d) {
    return static_cast<float>(-2.0 * std::log(d));
  });
  return bounded;
}

}  // namespace seastitch
