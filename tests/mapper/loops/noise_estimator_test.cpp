#include "mapper/noise/noise_estimator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "mapper/loops/registration_job.hpp"
#include "tests/mapper/bumpy_submap.hpp"

namespace seastitch {
namespace {

RegistrationResultSet Closure(int source,
                              double x,
                              double y,
                              double (*height)(double, double) = Bumps) {
  const Submap target = Make(0, {}, {}, height);
  LoopPair pair{SubmapId{0}, SubmapId{source}, {{x, y, 0.0}, {}}, 0.0};
  pair.prior.covariance = Eigen::Vector3d(0.25, 0.25, 1e-5).asDiagonal();
  PreparedSubmaps prepared({});
  const auto closed =
      std::make_shared<const Submap>(Make(source, {x, y, 0.0}, {x, y, 0.0}, height));
  return seastitch::Run(
      {closed, {pair}, {}},
      {},
      [&](SubmapId) { return std::make_shared<const Submap>(target); },
      &prepared);
}

TEST(ClosureStatistics, StateTheInformationOfTheirRegistration) {
  const RegistrationResultSet results = Closure(1, 10.0, 12.0);
  ASSERT_EQ(results.statistics.size(), 1u);
  const ClosureStatistics& s = results.statistics[0];
  EXPECT_TRUE(s.InformationUnder(s.registered_under).isApprox(results.edges[0].information, 1e-9));
  VarianceComponents louder = s.registered_under;
  louder.position_walk *= 10.0;
  EXPECT_LT(s.InformationUnder(louder).determinant(),
            0.5 * results.edges[0].information.determinant());
}

// Boulders stay where the survey's soundings turn out to be quiet.
TEST(ClosureStatistics, KeepWhatStructureFinerThanACellAdds) {
  const auto share_of_fixed = [](const ClosureStatistics& s) {
    return s.fixed.trace() / s.CovarianceUnder(s.registered_under).trace();
  };
  const RegistrationResultSet smooth = Closure(1, 10.0, 12.0);
  const RegistrationResultSet rough = Closure(1, 10.0, 12.0, BumpsAndBoulders);
  ASSERT_EQ(rough.statistics.size(), 1u);
  const ClosureStatistics& s = rough.statistics[0];
  EXPECT_TRUE(s.InformationUnder(s.registered_under).isApprox(rough.edges[0].information, 1e-9));
  EXPECT_GT(share_of_fixed(s), 3.0 * share_of_fixed(smooth.statistics.at(0)));
  EXPECT_GT(share_of_fixed(s), 0.15);
}

TEST(ClosureStatistics, ComeBackFromTheirNumbersAndFromNothingLess) {
  const ClosureStatistics s = Closure(1, 10.0, 12.0).statistics.at(0);
  std::vector<double> numbers = ToNumbers(s);
  EXPECT_EQ(ToNumbers(ClosureStatisticsFromNumbers(numbers)), numbers);
  numbers.pop_back();
  EXPECT_THROW(ClosureStatisticsFromNumbers(numbers), std::invalid_argument);
  EXPECT_THROW(ClosureStatisticsFromNumbers({}), std::invalid_argument);
}

TEST(NoiseEstimator, BeginsAtItsPriorAndDoesNotDependOnTheOrder) {
  const VarianceComponents prior;
  NoiseEstimator forwards(prior);
  EXPECT_EQ(forwards.components().correlated_error_ratio, prior.correlated_error_ratio);
  std::vector<ClosureStatistics> closures;
  for (const int i : {1, 2, 3}) closures.push_back(Closure(i, 8.0 + i, 10.0 + i).statistics.at(0));
  for (const ClosureStatistics& s : closures) forwards.Add(s);
  NoiseEstimator backwards(prior);
  std::reverse(closures.begin(), closures.end());
  for (const ClosureStatistics& s : closures) backwards.Add(s);
  EXPECT_EQ(forwards.components().correlated_error_ratio,
            backwards.components().correlated_error_ratio);
  EXPECT_EQ(forwards.components().position_walk, backwards.components().position_walk);
  // These submaps have neither shared errors nor walks, and less than what is expected shows.
  EXPECT_LT(forwards.components().correlated_error_ratio, prior.correlated_error_ratio);
  EXPECT_LT(forwards.components().position_walk, prior.position_walk);
  EXPECT_EQ(forwards.estimate().closures, 3);

  // What the graph has changes by more than a tenth, and then no more.
  EXPECT_FALSE(forwards.TakeRestated().empty());
  EXPECT_TRUE(forwards.TakeRestated().empty());
  for (const ClosureStatistics& s : closures) forwards.Remove(s.target, s.source);
  EXPECT_EQ(forwards.components().position_walk, prior.position_walk);
}

// It looks at few closures each time, and overlooks none.
TEST(NoiseEstimator, LeavesNoClosureWithASigmaThatIsOffByATenth) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const ClosureStatistics one = Closure(1, 10.0, 12.0).statistics.at(0);
  NoiseEstimator estimator{VarianceComponents()};
  std::size_t restated = 0;
  for (int i = 0; i < 120; ++i) {
    ClosureStatistics closure = one;
    closure.target = SubmapId{i};
    closure.source = SubmapId{i + 1};
    closure.scatter.residual_variance *= std::exp(0.03 * i + 0.5 * normal(random));
    closure.registered_under.sounding_variance_ratio *= std::exp(2.0 * normal(random));
    closure.registered_under.correlated_error_ratio *= std::exp(2.0 * normal(random));
    const auto tilt = static_cast<float>(3.0 * normal(random));
    for (float& value : closure.likelihood.values()) value *= tilt;
    estimator.Add(closure);
    estimator.StateAnew({closure.target, closure.source});
    if (i % 7 == 3) estimator.Remove(SubmapId{i / 2}, SubmapId{i / 2 + 1});
    restated += estimator.TakeRestated().size();
    for (const auto& [key, each] : estimator.closures()) {
      const Eigen::Matrix3d now = each.InformationUnder(each.Applicable(estimator.components()));
      const Eigen::Matrix3d stated = each.InformationUnder(each.stated_under);
      const auto ratios =
          Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d>(now, stated).eigenvalues();
      ASSERT_LT(std::sqrt(ratios.maxCoeff()), 1.1001) << i << " " << key.first.value;
      ASSERT_GT(std::sqrt(ratios.minCoeff()), 0.9090) << i << " " << key.first.value;
      ASSERT_EQ(estimator.outdated().contains(key), each.IsOutdated(estimator.components()))
          << i << " " << key.first.value;
    }
  }
  EXPECT_GT(restated, 10u);
}

// A likelihood that rises up to an end of the axis and beyond.
ClosureStatistics Steep(double position_walk_power, double error_ratio_power) {
  ClosureStatistics closure;
  closure.target = SubmapId{0};
  closure.source = SubmapId{1};
  for (std::size_t s = 0; s < kErrorRatioAxis.size; ++s)
    for (std::size_t q = 0; q < kPositionWalkAxis.size; ++q)
      for (std::size_t p = 0; p < kHeadingWalkAxis.size; ++p)
        closure.likelihood.Set(s,
                               q,
                               p,
                               -position_walk_power * static_cast<double>(q) -
                                   error_ratio_power * static_cast<double>(s));
  return closure;
}

TEST(NoiseEstimator, StatesABoundWithThePriorsSigmaAtAnEndOfAnAxis) {
  const VarianceComponents prior;
  const double prior_sigma =
      NoiseEstimator(prior).estimate().position_walk.log_sigma;  // about 1: a factor of e
  EXPECT_NEAR(prior_sigma, 1.0, 0.01);
  NoiseEstimator estimator{prior};
  estimator.Add(Steep(100.0, -100.0));
  const NoiseEstimate& found = estimator.estimate();
  EXPECT_EQ(found.position_walk.end, RangeEnd::kHigh);
  EXPECT_EQ(found.position_walk.value, 0.016);
  EXPECT_EQ(found.position_walk.log_sigma, 1.0);
  EXPECT_EQ(found.correlated_error_ratio.end, RangeEnd::kLow);
  EXPECT_EQ(found.correlated_error_ratio.log_sigma, 1.0);
  EXPECT_EQ(found.heading_walk.end, RangeEnd::kNone);
  // One node inside the axis it is an estimate.
  estimator.Add(Steep(2.0, 0.0));
  EXPECT_EQ(estimator.estimate().position_walk.end, RangeEnd::kNone);
  EXPECT_GT(estimator.estimate().position_walk.value, 2.0 * prior.position_walk);
}

TEST(NoiseEstimator, ForgetsWhatAPairSaidBefore) {
  std::vector<ClosureStatistics> closures;
  for (const int i : {1, 2, 3}) closures.push_back(Closure(i, 8.0 + i, 10.0 + i).statistics.at(0));
  NoiseEstimator direct{VarianceComponents()};
  NoiseEstimator changed{VarianceComponents()};
  for (ClosureStatistics closure : closures) {
    direct.Add(closure);
    closure.scatter.residual_variance *= 9.0;
    for (float& value : closure.likelihood.values()) value *= -3.0f;
    changed.Add(closure);
  }
  EXPECT_NE(changed.components().position_walk, direct.components().position_walk);
  EXPECT_NE(changed.components().sounding_variance_ratio,
            direct.components().sounding_variance_ratio);
  for (const ClosureStatistics& closure : closures) changed.Add(closure);
  changed.Remove(SubmapId{0}, SubmapId{2});
  changed.Add(closures[1]);
  EXPECT_EQ(changed.components().sounding_variance_ratio,
            direct.components().sounding_variance_ratio);
  EXPECT_EQ(changed.components().correlated_error_ratio,
            direct.components().correlated_error_ratio);
  EXPECT_EQ(changed.components().position_walk, direct.components().position_walk);
  EXPECT_EQ(changed.components().heading_walk, direct.components().heading_walk);
  EXPECT_EQ(changed.estimate().sounding_variance_ratio.log_sigma,
            direct.estimate().sounding_variance_ratio.log_sigma);
}

}  // namespace
}  // namespace seastitch
