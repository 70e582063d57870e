#include "mapper/registration/gicp.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mapper/registration/synthetic_pair.hpp"

namespace seastitch {
namespace {

const Eigen::Matrix3d kPrior = Eigen::Vector3d(0.25, 0.25, 1e-4).asDiagonal();

SyntheticPair HighRelief(std::uint64_t seed) {
  SyntheticPairParams params;
  params.points = 12'000;
  params.sounding_sigma_m = 0.02;
  return MakePair(SyntheticSeabed::Fractal(seed, 1.0), params, seed);
}

RegistrationResult RegisterPair(const SyntheticPair& pair,
                                const Pose2& T_prior,
                                const Eigen::Matrix3d& covariance = kPrior,
                                const RegistrationParams& params = {}) {
  const auto prepare = [](const SyntheticSubmap& submap) {
    return GicpSubmap(submap.cloud, LevelFromBody(submap.T_map_submap), {});
  };
  const RegistrationPrior prior{T_prior, covariance, pair.z_prior_m};
  return RegisterGicp(prepare(pair.target), prepare(pair.source), prior, {}, params);
}

Pose2 Beside(const Pose2& T, double x_m, double y_m, double yaw_rad) {
  return {T.x + x_m, T.y + y_m, T.yaw + yaw_rad};
}

TEST(Gicp, FindsTheSourceNearItsPrior) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const SyntheticPair pair = HighRelief(seed);
    const RegistrationResult result =
        RegisterPair(pair, Beside(pair.T_target_source, 0.6, -0.5, 0.01));
    EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict);
    const Pose2 error = Inverse(pair.T_target_source) * result.T_target_source;
    EXPECT_LT(error.Translation().norm(), 0.1) << seed;
    EXPECT_LT(std::abs(WrapAngle(error.yaw)), 0.005) << seed;
    EXPECT_LT(std::abs(result.z_offset_m), 0.02) << seed;
    EXPECT_GT(result.overlap_m2, 300.0);
    EXPECT_LT((result.overlap_center_m - OverlapCenter(pair)).norm(), 2.0) << seed;
  }
}

TEST(Gicp, WeighsEveryMatchAsThePaperDoes) {
  const SyntheticPair pair = HighRelief(4);
  const RegistrationResult result = RegisterPair(pair, pair.T_target_source);
  ASSERT_EQ(result.verdict, LoopVerdict::kAccepted);
  // A plane covariance has a sigma of 1 along it: sqrt(2) for two that lie flat, less on slopes.
  const Eigen::Matrix2d covariance = result.information.topLeftCorner<2, 2>().inverse();
  EXPECT_GT(std::sqrt(covariance(0, 0)), 1.2);
  EXPECT_LT(std::sqrt(covariance(0, 0)), 1.4143);
  EXPECT_EQ(result.information(2, 2), GicpParams{}.yaw_information);
}

TEST(Gicp, RefusesWhatIsFurtherThanNavigationCanBe) {
  const SyntheticPair pair = HighRelief(5);
  const Eigen::Matrix3d sure = Eigen::Vector3d(0.01, 0.01, 1e-6).asDiagonal();
  const RegistrationResult result =
      RegisterPair(pair, Beside(pair.T_target_source, 0.8, 0.0, 0.0), sure);
  EXPECT_EQ(result.verdict, LoopVerdict::kOutsideWindow) << ToString(result.verdict);
  EXPECT_TRUE(result.information.isZero());
}

TEST(Gicp, SaysLittleOverlapWhereTheTwoDoNotMeet) {
  const SyntheticPair pair = HighRelief(6);
  EXPECT_EQ(RegisterPair(pair, Beside(pair.T_target_source, 500.0, 0.0, 0.0)).verdict,
            LoopVerdict::kLittleOverlap);
  SyntheticPair nothing = pair;
  nothing.source.cloud = {};
  EXPECT_EQ(RegisterPair(nothing, pair.T_target_source).verdict, LoopVerdict::kLittleOverlap);
  nothing.source.cloud.Add({NAN, 0.0f, 0.0f});
  EXPECT_EQ(RegisterPair(nothing, pair.T_target_source).verdict, LoopVerdict::kLittleOverlap);
}

TEST(Gicp, RefusesPriorsThatAreNone) {
  const SyntheticPair pair = HighRelief(7);
  EXPECT_NE(RegisterPair(pair, {NAN, 0.0, 0.0}).verdict, LoopVerdict::kAccepted);
  EXPECT_NE(RegisterPair(pair, pair.T_target_source, Eigen::Matrix3d::Constant(NAN)).verdict,
            LoopVerdict::kAccepted);
}

}  // namespace
}  // namespace seastitch
