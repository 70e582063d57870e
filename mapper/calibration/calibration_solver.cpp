#include "mapper/calibration/calibration_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/core/pose.hpp"
#include "common/core/survey_noise.hpp"
#include "mapper/calibration/calibration_limits.hpp"

namespace seastitch {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;
constexpr Index kErrors = static_cast<Index>(kIntegrationErrors);
constexpr double kMps = 1.0 / SonarCalibration::kSmileSpeedMps;

constexpr Index ColumnOf(IntegrationError error) { return static_cast<Index>(error); }

// A priori sigmas of the integration errors, SI.
using ErrorVector = Eigen::Matrix<double, kErrors, 1>;
ErrorVector PriorSigmas() {
  ErrorVector sigma;
  sigma[ColumnOf(IntegrationError::kRoll)] = Deg2Rad(1.0);
  sigma[ColumnOf(IntegrationError::kSecondHeadRoll)] = Deg2Rad(1.0);
  sigma[ColumnOf(IntegrationError::kSmile)] = 0.5 * kMps;
  sigma[ColumnOf(IntegrationError::kAttitudeLatency)] = 0.05;
  sigma[ColumnOf(IntegrationError::kDepthLatency)] = 0.1;
  sigma[ColumnOf(IntegrationError::kRollScale)] = 0.02;
  sigma[ColumnOf(IntegrationError::kHeaveScale)] = 0.1;
  sigma[ColumnOf(IntegrationError::kPitch)] = Deg2Rad(0.1);
  sigma[ColumnOf(IntegrationError::kYaw)] = Deg2Rad(0.5);
  sigma[ColumnOf(IntegrationError::kProfile)] = 4.0 * kMps;
  sigma[ColumnOf(IntegrationError::kForward)] = 0.05;
  sigma[ColumnOf(IntegrationError::kStarboard)] = 0.05;
  return sigma;
}

// A priori errors of submaps: sigma, and the time over which they are alike; 0: independent.
struct SubmapPrior {
  double sigma;
  double correlation_s;
};
constexpr std::array<SubmapPrior, kSubmapErrors> kSubmapPriors{{
    {0.10, 0.0},
    {0.10, 0.0},
    {0.05, 600.0},
    {Deg2Rad(0.10), 300.0},
    {Deg2Rad(0.10), 1800.0},
    {Deg2Rad(0.10), 1800.0},
}};
// Submaps at one time would have one error, and an infinite weight to that.
constexpr double kShortestStepS = 1.0;

// Stated sigma beyond that of the model: docs/self-calibration.md.
constexpr double kInflation = 1.5;
constexpr std::array<double, 2> kTileSides_m{8.0, 16.0};

// Where the values stand among the unknowns, their unit in SI, and the least sigma stated, in
// the unit of SonarCalibration.
struct Applied {
  CalibrationKey key;
  IntegrationError error;
  double si_per_unit;
  double least_sigma;
};
constexpr std::array<Applied, kCalibrationKeys> kApplied{{
    {CalibrationKey::kRoll, IntegrationError::kRoll, 1.0, Deg2Rad(0.005)},
    {CalibrationKey::kSecondHeadRoll, IntegrationError::kSecondHeadRoll, 1.0, Deg2Rad(0.005)},
    {CalibrationKey::kSmile, IntegrationError::kSmile, kMps, 0.1},
    {CalibrationKey::kSmileByWater, IntegrationError::kProfile, kMps, 0.1},
    {CalibrationKey::kAttitudeLatency, IntegrationError::kAttitudeLatency, 1e-3, 0.3},
    {CalibrationKey::kDepthLatency, IntegrationError::kDepthLatency, 1e-3, 1.0},
    {CalibrationKey::kRollScale, IntegrationError::kRollScale, 0.01, 0.05},
    {CalibrationKey::kHeaveScale, IntegrationError::kHeaveScale, 0.01, 0.15},
}};

// Of a row's coefficients among all unknowns: the errors of submaps first.
class Unknowns {
 public:
  explicit Unknowns(std::size_t submaps) : submaps_(static_cast<Index>(submaps)) {}
  Index size() const { return errors() + kErrors; }
  Index errors() const { return kSubmapErrors * submaps_; }
  Index Of(std::size_t submap, int error) const {
    return kSubmapErrors * static_cast<Index>(submap) + error;
  }
  Index Of(const OverlapOfPair& pair, Index coefficient) const {
    if (coefficient < kErrors) return errors() + coefficient;
    const int error = static_cast<int>(coefficient - kErrors);
    return error < kSubmapErrors ? Of(pair.target, error) : Of(pair.source, error - kSubmapErrors);
  }

 private:
  Index submaps_;
};

// Priors of the errors of submaps, as an information matrix: tridiagonal for each kind.
void AddSubmapPriors(const std::vector<Time>& times,
                     const Unknowns& unknowns,
                     std::vector<Eigen::Triplet<double>>* out) {
  for (int error = 0; error < kSubmapErrors; ++error) {
    const auto& [sigma, correlation_s] = kSubmapPriors[static_cast<std::size_t>(error)];
    const double information = 1.0 / (sigma * sigma);
    for (std::size_t i = 0; i < times.size(); ++i) {
      const Index here = unknowns.Of(i, error);
      if (i == 0 || correlation_s == 0.0) {
        out->emplace_back(here, here, information);
        continue;
      }
      const double step_s = std::max(kShortestStepS, ToSeconds(times[i] - times[i - 1]));
      const double alike = std::exp(-step_s / correlation_s);
      const double of_step = information / (1.0 - alike * alike);
      const Index before = unknowns.Of(i - 1, error);
      out->emplace_back(before, before, alike * alike * of_step);
      out->emplace_back(here, here, of_step);
      out->emplace_back(before, here, -alike * of_step);
      out->emplace_back(here, before, -alike * of_step);
    }
  }
}

// The mean of each error of submaps that is alike over time: it belongs to the integration errors.
Eigen::MatrixXd MeansOf(std::size_t submaps, const Unknowns& unknowns) {
  std::vector<int> alike;
  for (int error = 0; error < kSubmapErrors; ++error)
    if (kSubmapPriors[static_cast<std::size_t>(error)].correlation_s > 0.0) alike.push_back(error);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(unknowns.size(), static_cast<Index>(alike.size()));
  for (std::size_t k = 0; k < alike.size(); ++k)
    for (std::size_t i = 0; i < submaps; ++i)
      C(unknowns.Of(i, alike[k]), static_cast<Index>(k)) = 1.0 / static_cast<double>(submaps);
  return C;
}

// Linear system of all unknowns, whose means (MeansOf()) are zero.
class System {
 public:
  System(const std::vector<Time>& times, const Unknowns& unknowns)
      : unknowns_(unknowns),
        b_(Eigen::VectorXd::Zero(unknowns.size())),
        means_(MeansOf(times.size(), unknowns)) {
    AddSubmapPriors(times, unknowns, &priors_);
    const ErrorVector sigma = PriorSigmas();
    for (Index k = 0; k < kErrors; ++k)
      priors_.emplace_back(
          unknowns.errors() + k, unknowns.errors() + k, 1.0 / (sigma[k] * sigma[k]));
  }

  void Add(const OverlapOfPair& pair) {
    Eigen::Matrix<double, kRowSize, kRowSize> N = Eigen::Matrix<double, kRowSize, kRowSize>::Zero();
    Eigen::Matrix<double, kRowSize, 1> b = Eigen::Matrix<double, kRowSize, 1>::Zero();
    for (const OverlapRow& row : pair.rows) {
      N += row.weight * row.coefficients * row.coefficients.transpose();
      b += row.weight * row.y * row.coefficients;
    }
    for (Index i = 0; i < kRowSize; ++i) {
      b_[unknowns_.Of(pair, i)] += b[i];
      for (Index j = 0; j < kRowSize; ++j) {
        const Index row = unknowns_.Of(pair, i), column = unknowns_.Of(pair, j);
        if (row >= column) measured_.emplace_back(row, column, N(i, j));  // the factor's half
      }
    }
  }

  // False where the system cannot be solved.
  bool Factor() {
    std::vector<Eigen::Triplet<double>> all = measured_;
    all.insert(all.end(), priors_.begin(), priors_.end());
    Sparse M(unknowns_.size(), unknowns_.size());
    M.setFromTriplets(all.begin(), all.end());
    factor_.compute(M);
    if (factor_.info() != Eigen::Success) return false;
    by_means_ = factor_.solve(means_);
    of_means_ = (means_.transpose() * by_means_).eval();
    return by_means_.allFinite();
  }

  // Solution of the constrained system for right sides.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& right) const {
    const Eigen::MatrixXd x = factor_.solve(right);
    return x - by_means_ * of_means_.ldlt().solve(means_.transpose() * x);
  }
  const Eigen::VectorXd& b() const { return b_; }
  Sparse Priors() const {
    Sparse P(unknowns_.size(), unknowns_.size());
    P.setFromTriplets(priors_.begin(), priors_.end());
    return P;
  }
  // Column of the integration errors.
  Eigen::MatrixXd UnitErrors() const {
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(unknowns_.size(), kErrors);
    unit.bottomRows<kErrors>().setIdentity();
    return unit;
  }
  // The unknowns where the integration errors are given.
  Eigen::VectorXd Given(const ErrorVector& errors) const {
    // With x = M^-1 (b + E m): the m for which the errors come out as given.
    const Eigen::MatrixXd by_unit = Solve(UnitErrors());
    const Eigen::VectorXd free = Solve(b_);
    const Eigen::Matrix<double, kErrors, kErrors> covariance = by_unit.bottomRows<kErrors>();
    const ErrorVector forced = covariance.ldlt().solve(errors - free.tail<kErrors>());
    return free + by_unit * forced;
  }

 private:
  Unknowns unknowns_;
  std::vector<Eigen::Triplet<double>> measured_;
  std::vector<Eigen::Triplet<double>> priors_;
  Eigen::VectorXd b_;
  Eigen::MatrixXd means_;
  Eigen::SimplicialLDLT<Sparse> factor_;
  Eigen::MatrixXd by_means_;
  Eigen::MatrixXd of_means_;
};

double ErrorOf(const OverlapOfPair& pair,
               const OverlapRow& row,
               const Unknowns& unknowns,
               const Eigen::VectorXd& x) {
  double predicted = 0.0;
  for (Index i = 0; i < kRowSize; ++i) predicted += row.coefficients[i] * x[unknowns.Of(pair, i)];
  return row.y - predicted;
}

// Sums of the scores of rows by parts of the seabed, or by pairs: their scatter is the scatter of
// the estimate.
class Scores {
 public:
  using Key = std::pair<std::int64_t, std::int64_t>;
  void Add(const Key& key, const ErrorVector& score) {
    const auto [place, is_new] = sums_.try_emplace(key, score);
    if (!is_new) place->second += score;
  }
  Eigen::Matrix<double, kErrors, kErrors> Covariance() const {
    Eigen::Matrix<double, kErrors, kErrors> sum = Eigen::Matrix<double, kErrors, kErrors>::Zero();
    for (const auto& [key, score] : sums_) sum += score * score.transpose();
    const auto n = static_cast<double>(sums_.size());
    return n > 1.0 ? Eigen::Matrix<double, kErrors, kErrors>(sum * n / (n - 1.0)) : sum;
  }

 private:
  std::map<Key, ErrorVector> sums_;
};

// RMS of height differences under two hypotheses.
struct Mismatch {
  double sum = 0.0, trust = 0.0;
  void Add(double error_m, double by) {
    sum += by * error_m * error_m;
    trust += by;
  }
  double Rms() const { return trust > 0.0 ? std::sqrt(sum / trust) : 0.0; }
};

// The smile is the sum of what steering and what the profile cause: their split is hardly known.
double ValueOf(const Applied& of, const ErrorVector& x) {
  double value = x[ColumnOf(of.error)];
  if (of.error == IntegrationError::kSmile) value += x[ColumnOf(IntegrationError::kProfile)];
  return value / of.si_per_unit;
}
double SigmaOf(const Applied& of, const Eigen::Matrix<double, kErrors, kErrors>& covariance) {
  ErrorVector of_value = ErrorVector::Zero();
  of_value[ColumnOf(of.error)] = 1.0;
  if (of.error == IntegrationError::kSmile) of_value[ColumnOf(IntegrationError::kProfile)] = 1.0;
  return std::sqrt(std::max(0.0, of_value.dot(covariance * of_value))) / of.si_per_unit;
}

// Integration errors of what is applied.
ErrorVector AppliedErrors(const CalibrationEstimate& estimate) {
  ErrorVector errors = ErrorVector::Zero();
  for (const Applied& of : kApplied)
    if (estimate.Of(of.key).is_clear)
      errors[ColumnOf(of.error)] = estimate.Of(of.key).add * of.si_per_unit;
  // The smile is the sum of both.
  errors[ColumnOf(IntegrationError::kSmile)] -= errors[ColumnOf(IntegrationError::kProfile)];
  return errors;
}

// Sets RMS and sigma of one error of the submaps. Of its sigma, some of them tell enough.
void Measure(int error,
             const Unknowns& unknowns,
             const System& system,
             const Eigen::VectorXd& x,
             SlowError* out) {
  constexpr std::size_t kMostLooks = 32;
  constexpr double kTooSmall = 2.0;  // the model's sigma: docs/self-calibration.md
  SlowError& slow = *out;
  const auto submaps = static_cast<std::size_t>(unknowns.errors() / kSubmapErrors);
  for (std::size_t i = 0; i < submaps; ++i) slow.rms += std::pow(x[unknowns.Of(i, error)], 2);
  slow.rms = std::sqrt(slow.rms / static_cast<double>(submaps));
  const std::size_t looks = std::min(kMostLooks, submaps);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(unknowns.size(), static_cast<Index>(looks));
  const auto at = [&](std::size_t k) { return unknowns.Of(k * submaps / looks, error); };
  for (std::size_t k = 0; k < looks; ++k) unit(at(k), static_cast<Index>(k)) = 1.0;
  const Eigen::MatrixXd covariance = system.Solve(unit);
  for (std::size_t k = 0; k < looks; ++k) slow.sigma += covariance(at(k), static_cast<Index>(k));
  slow.sigma = kTooSmall * std::sqrt(std::max(0.0, slow.sigma) / static_cast<double>(looks));
}

}  // namespace

CalibrationEstimate EstimateCalibration(const std::vector<Time>& times, const ForEachPair& pairs) {
  CalibrationEstimate estimate;
  if (times.empty()) return estimate;
  const Unknowns unknowns(times.size());
  System system(times, unknowns);
  pairs([&](const OverlapOfPair& pair) {
    ++estimate.pairs;
    estimate.cells += static_cast<std::int64_t>(pair.rows.size());
    system.Add(pair);
  });
  if (estimate.pairs == 0 || !system.Factor()) return estimate;
  const Eigen::VectorXd x = system.Solve(system.b());
  const Eigen::MatrixXd by_unit = system.Solve(system.UnitErrors());
  const Eigen::VectorXd nothing = system.Given(ErrorVector::Zero());

  std::array<Scores, kTileSides_m.size() + 1> scores;
  Mismatch before;
  pairs([&](const OverlapOfPair& pair) {
    for (const OverlapRow& row : pair.rows) {
      before.Add(ErrorOf(pair, row, unknowns, nothing), row.trust);
      const double weighted = row.weight * ErrorOf(pair, row, unknowns, x);
      ErrorVector score = ErrorVector::Zero();
      for (Index i = 0; i < kRowSize; ++i)
        score += weighted * row.coefficients[i] * by_unit.row(unknowns.Of(pair, i)).transpose();
      for (std::size_t k = 0; k < kTileSides_m.size(); ++k)
        scores[k].Add({static_cast<std::int64_t>(std::floor(row.p_map.x() / kTileSides_m[k])),
                       static_cast<std::int64_t>(std::floor(row.p_map.y() / kTileSides_m[k]))},
                      score);
      scores.back().Add(
          {static_cast<std::int64_t>(pair.target), static_cast<std::int64_t>(pair.source)}, score);
    }
  });
  const Eigen::Matrix<double, kErrors, kErrors> of_model = by_unit.bottomRows<kErrors>();
  const Eigen::Matrix<double, kErrors, kErrors> of_priors =
      by_unit.transpose() * (system.Priors() * by_unit);
  const ErrorVector errors = x.tail<kErrors>();
  for (const Applied& of : kApplied) {
    CalibratedValue& value = estimate.values[static_cast<std::size_t>(of.key)];
    double sigma = SigmaOf(of, of_model);
    constexpr double kNoLess = 0.999;  // of the prior: nothing was measured
    if (sigma > kNoLess * PriorSigmas()[ColumnOf(of.error)] / of.si_per_unit) continue;
    for (const Scores& by_part : scores)
      sigma = std::max(sigma, SigmaOf(of, by_part.Covariance() + of_priors));
    value.add = ValueOf(of, errors);
    value.sigma = Hypotenuse(kInflation * sigma, of.least_sigma);
    const CalibrationName& name = kCalibrationNames[static_cast<std::size_t>(of.key)];
    value.is_clear = estimate.HasEnough() && std::abs(value.add) > kAdviceSigmas * value.sigma &&
                     std::abs(value.add) >= name.smallest * name.per_unit;
  }
  if (!IsPossible(estimate))
    for (CalibratedValue& value : estimate.values) value.is_clear = false;
  // The smile is known far better than the part of the water. The likelier split is taken.
  estimate.values[static_cast<std::size_t>(CalibrationKey::kSmileByWater)].is_clear =
      estimate.Of(CalibrationKey::kSmile).is_clear;
  estimate.before_m = estimate.after_m = before.Rms();
  estimate.depth_part =
      std::abs(estimate.Of(CalibrationKey::kSmile).add) / SonarCalibration::kSmileSpeedMps;
  if (estimate.HasEnough()) {
    Measure(kDownError, unknowns, system, x, &estimate.depth_m);
    Measure(kRollError, unknowns, system, x, &estimate.roll_rad);
  }
  if (!estimate.HasClear()) return estimate;

  const Eigen::VectorXd tried = system.Given(AppliedErrors(estimate));
  Mismatch after;
  pairs([&](const OverlapOfPair& pair) {
    for (const OverlapRow& row : pair.rows)
      after.Add(ErrorOf(pair, row, unknowns, tried), row.trust);
  });
  estimate.after_m = after.Rms();
  if (estimate.after_m >= estimate.before_m)
    for (CalibratedValue& value : estimate.values) value.is_clear = false;
  return estimate;
}

}  // namespace seastitch
