#include "common/core/pose.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace seastitch {
namespace {

class RandomPoses {
 public:
  double Uniform(double limit) {
    return std::uniform_real_distribution<double>(-limit, limit)(engine_);
  }
  double Normal() { return std::normal_distribution<double>()(engine_); }
  Pose2 Level() { return {Uniform(500.0), Uniform(500.0), Uniform(kPi)}; }
  Eigen::Isometry3d Body() {
    return MakePose({Uniform(500.0), Uniform(500.0), Uniform(50.0)},
                    RotationFromRpy(Uniform(0.5), Uniform(0.5), Uniform(kPi)));
  }
  Eigen::Matrix<double, 6, 6> Covariance(double scale) {
    Eigen::Matrix<double, 6, 6> a;
    for (double& value : a.reshaped()) value = scale * Normal();
    return a * a.transpose();
  }

 private:
  std::mt19937 engine_{7};
};

void ExpectSame(const Pose2& a, const Pose2& b) {
  EXPECT_NEAR(a.x, b.x, 1e-9);
  EXPECT_NEAR(a.y, b.y, 1e-9);
  EXPECT_NEAR(WrapAngle(a.yaw - b.yaw), 0.0, 1e-12);
}

TEST(WrapAngle, StaysInTheHalfOpenIntervalAndKeepsTheDirection) {
  for (const double angle : {0.0, kPi, -kPi, 3.0 * kPi, -7.0, 100.0, 1e6}) {
    const double wrapped = WrapAngle(angle);
    EXPECT_GE(wrapped, -kPi);
    EXPECT_LT(wrapped, kPi);
    EXPECT_NEAR(std::sin(wrapped), std::sin(angle), 1e-9);
    EXPECT_NEAR(std::cos(wrapped), std::cos(angle), 1e-9);
  }
}

TEST(RotationFromRpy, TurnsYawFromNorthToEastPitchUpAndRollToStarboardDown) {
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d starboard = Eigen::Vector3d::UnitY();
  EXPECT_TRUE((RotationFromRpy(0, 0, kPi / 2) * forward).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_LT((RotationFromRpy(0, 0.1, 0) * forward).z(), 0.0);    // the bow rises, z is down
  EXPECT_GT((RotationFromRpy(0.1, 0, 0) * starboard).z(), 0.0);  // the starboard side sinks
}

TEST(RpyFromRotation, GivesBackTheAngles) {
  RandomPoses random;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d rpy(random.Uniform(3.0), random.Uniform(1.5), random.Uniform(3.0));
    EXPECT_TRUE(RpyFromRotation(RotationFromRpy(rpy.x(), rpy.y(), rpy.z())).isApprox(rpy, 1e-9));
  }
}

TEST(Pose2, IsAGroup) {
  RandomPoses random;
  for (int i = 0; i < 100; ++i) {
    const Pose2 a = random.Level();
    const Pose2 b = random.Level();
    const Pose2 c = random.Level();
    ExpectSame(Inverse(a) * a, Pose2{});
    ExpectSame(a * Inverse(a), Pose2{});
    ExpectSame((a * b) * c, a * (b * c));
  }
}

TEST(Pose2, MovesPointsLikeTheComposedPose) {
  RandomPoses random;
  const Pose2 a = random.Level();
  const Pose2 b = random.Level();
  const Eigen::Vector2d p(3.0, -4.0);
  EXPECT_TRUE(((a * b) * p).isApprox(a * (b * p), 1e-12));
}

TEST(LevelFromBody, IsThePoseWithoutItsLevelPart) {
  RandomPoses random;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d T = random.Body();
    const Eigen::Matrix3d yaw =
        Eigen::AngleAxisd(LevelPose(T).yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    EXPECT_TRUE((yaw * LevelFromBody(T)).isApprox(T.linear(), 1e-12));
    EXPECT_NEAR(RpyFromRotation(LevelFromBody(T)).z(), 0.0, 1e-12);
  }
}

TEST(WithLevelPose, KeepsDepthRollAndPitch) {
  RandomPoses random;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d before = random.Body();
    const Pose2 level = random.Level();
    const Eigen::Isometry3d after = WithLevelPose(before, level);
    ExpectSame(LevelPose(after), level);
    EXPECT_EQ(after.translation().z(), before.translation().z());
    EXPECT_TRUE(RpyFromRotation(after.linear())
                    .head<2>()
                    .isApprox(RpyFromRotation(before.linear()).head<2>(), 1e-12));
  }
}

TEST(WithLevelPose, GivesTheSamePoseForItsOwnLevelPose) {
  RandomPoses random;
  const Eigen::Isometry3d T = random.Body();
  EXPECT_TRUE(WithLevelPose(T, LevelPose(T)).isApprox(T, 1e-14));
}

// x, y, yaw of Inverse(a) * b.
Eigen::Vector3d Relative(const Pose2& a, const Pose2& b) { return (Inverse(a) * b).Vector(); }

Pose2 Moved(const Pose2& T, const Eigen::Vector3d& d) {
  return {T.x + d.x(), T.y + d.y(), T.yaw + d.z()};
}

TEST(RelativeCovariance, AgreesWithTheNumericalJacobian) {
  RandomPoses random;
  for (int i = 0; i < 50; ++i) {
    const Pose2 a = random.Level();
    const Pose2 b = random.Level();
    const Eigen::Matrix<double, 6, 6> joint = random.Covariance(0.1);
    Eigen::Matrix<double, 3, 6> J;
    for (int k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-6;
      Eigen::Matrix<double, 6, 1> d = Eigen::Matrix<double, 6, 1>::Zero();
      d[k] = kStep;
      Eigen::Vector3d change = Relative(Moved(a, d.head<3>()), Moved(b, d.tail<3>())) -
                               Relative(Moved(a, -d.head<3>()), Moved(b, -d.tail<3>()));
      change.z() = WrapAngle(change.z());
      J.col(k) = change / (2.0 * kStep);
    }
    const Eigen::Matrix3d expected = J * joint * J.transpose();
    const Eigen::Matrix3d got = RelativeCovariance(a,
                                                   b,
                                                   joint.topLeftCorner<3, 3>(),
                                                   joint.bottomRightCorner<3, 3>(),
                                                   joint.topRightCorner<3, 3>());
    EXPECT_TRUE(got.isApprox(expected, 1e-5)) << got << "\n\n" << expected;
  }
}

TEST(RelativeCovariance, AgreesWithScatteredPoses) {
  RandomPoses random;
  const Pose2 a{10.0, -20.0, 0.4};
  const Pose2 b{60.0, 35.0, -2.0};
  const Eigen::Matrix<double, 6, 6> joint = random.Covariance(0.003);
  const Eigen::Matrix<double, 6, 6> L = joint.llt().matrixL();
  constexpr int kSamples = 20'000;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    Eigen::Matrix<double, 6, 1> n;
    for (double& value : n) value = random.Normal();
    const Eigen::Matrix<double, 6, 1> d = L * n;
    const Eigen::Vector3d e =
        Relative(Moved(a, d.head<3>()), Moved(b, d.tail<3>())) - Relative(a, b);
    scatter += e * e.transpose() / kSamples;
  }
  const Eigen::Matrix3d got = RelativeCovariance(a,
                                                 b,
                                                 joint.topLeftCorner<3, 3>(),
                                                 joint.bottomRightCorner<3, 3>(),
                                                 joint.topRightCorner<3, 3>());
  EXPECT_TRUE(got.isApprox(scatter, 0.05)) << got << "\n\n" << scatter;
}

TEST(RelativeCovariance, IsZeroBetweenPosesThatOnlyMoveTogether) {
  const Pose2 a{1.0, 2.0, 0.3};
  Eigen::Matrix3d shift = Eigen::Matrix3d::Zero();
  shift.diagonal() << 4.0, 9.0, 0.0;  // no yaw: that would swing b about a
  EXPECT_TRUE(RelativeCovariance(a, {5.0, 5.0, 1.0}, shift, shift, shift).isZero(1e-12));
}

}  // namespace
}  // namespace seastitch
