#include "mapper/noise/closure_statistics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace seastitch {
namespace {

// Weight of the survey's value in the estimate of one pair, in degrees of freedom.
constexpr double kBelief = 10.0;
constexpr double kOutdated = 4.0;

using SmallMatrix = ClosureStatistics::SmallMatrix;

// Writes the numbers of a record one after the other.
class Writer {
 public:
  explicit Writer(std::vector<double>* numbers) : numbers_(numbers) {}
  template <class T>
  void operator()(const T& value) {
    numbers_->push_back(static_cast<double>(value));
  }

 private:
  std::vector<double>* numbers_;
};

class Reader {
 public:
  explicit Reader(const std::vector<double>& numbers) : numbers_(numbers) {}
  template <class T>
  void operator()(T& value) {
    if (next_ == numbers_.size() || !std::isfinite(numbers_[next_]))
      throw std::invalid_argument("closure statistics: cut off, or not finite");
    value = static_cast<T>(numbers_[next_++]);
  }
  bool AtEnd() const { return next_ == numbers_.size(); }

 private:
  const std::vector<double>& numbers_;
  std::size_t next_ = 0;
};

template <class Visitor, class Components>
void VisitComponents(Visitor* visit, Components& c) {
  (*visit)(c.sounding_variance_ratio);
  (*visit)(c.correlated_error_ratio);
  (*visit)(c.position_walk);
  (*visit)(c.heading_walk);
}

// Visits all numbers of the statistics. All matrices have the rank that was visited before.
template <class Visitor, class Statistics>
void VisitNumbers(Visitor* visit, Statistics& s) {
  (*visit)(s.scatter.prior_variance);
  (*visit)(s.scatter.residual_variance);
  (*visit)(s.scatter.degrees);
  (*visit)(s.scatter.least_variance);
  (*visit)(s.altitude_m);
  for (auto& value : s.likelihood.values()) (*visit)(value);
  for (auto* matrix :
       {&s.fixed, &s.white, &s.correlated_error, &s.position_walk, &s.heading_walk, &s.jacobian})
    for (Eigen::Index i = 0; i < matrix->size(); ++i) (*visit)(matrix->data()[i]);
  VisitComponents(visit, s.registered_under);
  VisitComponents(visit, s.stated_under);
}

}  // namespace

double SoundingScatter::VarianceUnder(const VarianceComponents& components) const {
  const double expected = components.sounding_variance_ratio * prior_variance;
  return std::max(least_variance,
                  (degrees * residual_variance + kBelief * expected) / (degrees + kBelief));
}

SmallMatrix ClosureStatistics::CovarianceUnder(const VarianceComponents& components) const {
  const auto squared = [](double sigma) { return sigma * sigma; };
  return fixed + scatter.VarianceUnder(components) * white +
         squared(components.correlated_error_ratio * altitude_m) * correlated_error +
         squared(components.position_walk) * position_walk +
         squared(components.heading_walk) * heading_walk;
}

Eigen::Matrix3d ClosureStatistics::InformationUnder(const VarianceComponents& components) const {
  const SmallMatrix information = CovarianceUnder(components).inverse();
  const Eigen::Matrix3d full = jacobian.transpose() * information * jacobian;
  return 0.5 * (full + full.transpose());
}

VarianceComponents ClosureStatistics::Applicable(const VarianceComponents& survey) const {
  VarianceComponents applicable = survey;
  const auto keep_larger = [&](double VarianceComponents::*figure) {
    if (registered_under.*figure > kOutdated * survey.*figure)
      applicable.*figure = registered_under.*figure;
  };
  keep_larger(&VarianceComponents::sounding_variance_ratio);
  keep_larger(&VarianceComponents::correlated_error_ratio);
  return applicable;
}

bool ClosureStatistics::IsOutdated(const VarianceComponents& survey) const {
  return registered_under.sounding_variance_ratio > kOutdated * survey.sounding_variance_ratio ||
         registered_under.correlated_error_ratio > kOutdated * survey.correlated_error_ratio;
}

double ClosureStatistics::LogUntilOutdated(const VarianceComponents& survey) const {
  const auto until = [&](double VarianceComponents::*figure) {
    const double log = std::log(registered_under.*figure / (kOutdated * survey.*figure));
    return std::isnan(log) ? 0.0 : std::abs(log);
  };
  return std::min(until(&VarianceComponents::sounding_variance_ratio),
                  until(&VarianceComponents::correlated_error_ratio));
}

std::vector<double> ToNumbers(const ClosureStatistics& statistics) {
  std::vector<double> numbers;
  Writer write(&numbers);
  write(statistics.target.value);
  write(statistics.source.value);
  write(statistics.fixed.rows());
  VisitNumbers(&write, statistics);
  return numbers;
}

ClosureStatistics ClosureStatisticsFromNumbers(const std::vector<double>& numbers) {
  Reader read(numbers);
  ClosureStatistics statistics;
  Eigen::Index rank = 0;
  read(statistics.target.value);
  read(statistics.source.value);
  read(rank);
  if (rank < 1 || rank > 3)
    throw std::invalid_argument("closure statistics: rank " + std::to_string(rank));
  for (SmallMatrix* matrix : {&statistics.fixed,
                              &statistics.white,
                              &statistics.correlated_error,
                              &statistics.position_walk,
                              &statistics.heading_walk})
    matrix->setZero(rank, rank);
  statistics.jacobian.setZero(rank, 3);
  VisitNumbers(&read, statistics);
  if (!read.AtEnd()) throw std::invalid_argument("closure statistics: too long");
  return statistics;
}

}  // namespace seastitch
