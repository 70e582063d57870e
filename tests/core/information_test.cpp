#include "common/core/information.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/core/example_information.hpp"

namespace seastitch {
namespace {

TEST(SqrtInformation, WorksForEveryRank) {
  const Eigen::Vector3d yaw_only(0.0, 0.0, 1e4);
  const struct {
    Eigen::Matrix3d information;
    int rank;
  } cases[] = {{CorrelatedInformation(), 3},
               {RidgeInformation(), 1},
               {RidgeInformation() + Eigen::Matrix3d(yaw_only.asDiagonal()), 2},
               {Eigen::Matrix3d::Zero(), 0}};
  for (const auto& c : cases) {
    const auto root = FactorInformation(c.information);
    ASSERT_TRUE(root);
    EXPECT_EQ(root->rank, c.rank);
    EXPECT_LT((root->W.transpose() * root->W - c.information).norm(),
              1e-9 * (1.0 + c.information.norm()));
  }
}

TEST(SqrtInformation, RefusesWhatIsNoInformation) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
  m(1, 2) = m(2, 1) = nan;
  EXPECT_FALSE(FactorInformation(m));
  m = Eigen::Matrix3d::Identity();
  m(0, 1) = m(1, 0) = 1.001;  // indefinite with a positive diagonal
  EXPECT_FALSE(FactorInformation(m));
  m = Eigen::Matrix3d::Identity();
  m(0, 1) = 0.5;  // not symmetric
  EXPECT_FALSE(FactorInformation(m));
  m = -Eigen::Matrix3d::Identity();
  EXPECT_FALSE(FactorInformation(m));
  m = 2.0 * kMaxInformation * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(FactorInformation(m));
}

}  // namespace
}  // namespace seastitch
