#include "optimizer/solver/heading_chain.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace seastitch {
namespace {

// The information that all headings together hold of an error that they share, by the joint
// covariance.
double Exact(int n, double P, double k) {
  Eigen::MatrixXd C(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) C(i, j) = P * std::pow(k, std::abs(i - j));
  }
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(n);
  return ones.dot(C.inverse() * ones);
}

double Total(const HeadingInformation& headings, int n) {
  return headings.first + n * headings.each;
}

TEST(HeadingChain, OfACompassHoldsWhatTheJointCovarianceHolds) {
  constexpr double kP = 4e-4;
  for (const double k : {0.2, 0.8, 0.99}) {
    for (const int n : {2, 10, 60}) {
      const std::vector<HeadingStep> steps(static_cast<std::size_t>(n - 1),
                                           {kP, kP, 2.0 * (1.0 - k) * kP});
      const HeadingInformation headings = InformationOfHeadings(kP, steps);
      EXPECT_NEAR(Total(headings, n) / Exact(n, kP, k), 1.0, 1e-9) << k << ", " << n;
      EXPECT_NEAR(headings.first * kP, 0.0, 1e-9);
    }
  }
}

TEST(HeadingChain, OfAFreeGyroKnowsTheFirstAlone) {
  const HeadingInformation headings =
      InformationOfHeadings(4e-4, {{4e-4, 5e-4, 1e-4}, {5e-4, 6e-4, 1e-4}});
  EXPECT_DOUBLE_EQ(headings.first, 1.0 / 4e-4);
  EXPECT_EQ(headings.each, 0.0);
}

TEST(HeadingChain, OfOneSubmapIsItsOwn) {
  EXPECT_DOUBLE_EQ(InformationOfHeadings(4e-4, {}).first, 1.0 / 4e-4);
}

// One turn in which nearly all is new, between lines that forget little.
TEST(HeadingChain, ATurnDoesNotSpeakForTheLines) {
  std::vector<HeadingStep> steps(20, {4e-4, 4e-4, 1e-5});
  steps[10].P_step = 7e-4;
  const HeadingInformation headings = InformationOfHeadings(4e-4, steps);
  EXPECT_NEAR(headings.first, 0.0, 1e-6);
  EXPECT_GT(21 * headings.each, 1.5 / 4e-4);
}

// Right after the start the filter's variance falls.
TEST(HeadingChain, WhoseVariancesFallIsNeverSurerThanItsSurestHeadingsWouldBe) {
  const HeadingInformation headings =
      InformationOfHeadings(9e-4, {{9e-4, 4e-4, 2e-4}, {4e-4, 4e-4, 1e-6}});
  EXPECT_GE(headings.first, 0.0);
  EXPECT_LE(Total(headings, 3), 3.0 / 4e-4);
}

}  // namespace
}  // namespace seastitch
