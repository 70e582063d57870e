// RelativeCovariance() and Hindsight() against a filter that really carries clones of the pose
// (stochastic cloning: Roumeliotis and Burdick, ICRA 2002). The two share the covariance at the
// start, the estimates about which they linearise and the strapdown step, and nothing else: here
// the models are written as formulas of the state, differentiated numerically, and what one sensor
// measures at an instant is taken at once.

#include "tests/mapper/navigation/cloned_dive.hpp"

namespace seastitch {
namespace {

// In every direction of x, y and yaw, for every pair of frames.
void ExpectPublishedClonesToAgree(const ClonedDive& dive, std::size_t frames, double tolerance) {
  for (std::size_t b = 1; b < frames; ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const VarianceRatio ratio = Compare(dive.Kept(a, b), dive.Cloned(Clones::kPublished, a, b));
      EXPECT_NEAR(ratio.least, 1.0, tolerance) << "frames " << a << " and " << b;
      EXPECT_NEAR(ratio.most, 1.0, tolerance) << "frames " << a << " and " << b;
    }
}

TEST(ClonedStates, OfPublishedPosesGiveTheRelativeCovariance) {
  ExpectPublishedClonesToAgree(DiveWithFramesOnWholeSeconds(), kWholeSeconds.size(), 5e-4);
}

// Between them a pose's error is carried there by its velocity's, whatever was measured meanwhile:
// a twentieth of sigma.
TEST(ClonedStates, BetweenWholeSecondsAgreeWithinATenthOfTheVariance) {
  const std::vector<double> frames_s{10.3, 40.5, 67.7, 120.48, 140.24, 160.5, 225.4};
  ExpectPublishedClonesToAgree(ClonedDive(frames_s), frames_s.size(), 0.1);
}

// A track that mended its past would be surer of it: that is not what submaps were built upon.
// By 2.2 % of the variance at least: half of that here, twenty times what the same may differ by.
TEST(ClonedStates, CorrectedAfterwardsWouldClaimMore) {
  const ClonedDive& dive = DiveWithFramesOnWholeSeconds();
  for (std::size_t b = 1; b < kWholeSeconds.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const VarianceRatio ratio = Compare(dive.Kept(a, b), dive.Cloned(Clones::kCorrected, a, b));
      EXPECT_GT(ratio.least, 1.01) << "frames " << a << " and " << b;
      EXPECT_GT(ratio.most, 1.05) << "frames " << a << " and " << b;
    }
}

// Corrections of up to 0.39 m and 0.08 degrees, the same to 3 mm and 0.004 degrees, which are
// products of two errors and grow with time: over half a minute 1 % in position. Anchors on whole
// seconds, seen from tenths between them.
TEST(ClonedStates, CorrectedAfterwardsGiveHindsight) {
  const std::vector<double> frames_s{10.0, 10.7, 40.0, 40.6, 67.0, 67.9, 120.0, 140.5, 225.4};
  const ClonedDive dive(frames_s);
  Eigen::Vector3d largest = Eigen::Vector3d::Zero();
  for (std::size_t b = 1; b < frames_s.size(); ++b)
    for (std::size_t a = 0; a < b; a += 2) {
      const Eigen::Vector3d cloned = dive.ClonedCorrection(a, b);
      const Eigen::Vector3d apart = dive.KeptCorrection(a, b) - cloned;
      const double position_m = cloned.head<2>().norm();
      EXPECT_LT(apart.head<2>().norm(), 1e-4 + 0.035 * position_m) << "frame " << a << " at " << b;
      EXPECT_LT(std::abs(apart.z()), 2e-6 + 0.2 * std::abs(cloned.z())) << a << " at " << b;
      largest = largest.cwiseMax(cloned.cwiseAbs());
    }
  EXPECT_GT(largest.head<2>().norm(), 0.25);
  EXPECT_GT(largest.z(), Deg2Rad(0.06));
}

// In one piece, and in two that meet in the middle of the dive.
TEST(ClonedStates, TheSmoothedTrackIsThatOfHindsight) {
  const ClonedDive& dive = DiveWithFramesOnWholeSeconds();
  const Time end = *dive.track().latest();
  NavTrack whole = dive.track();
  const std::vector<SmoothedPose> smoothed = whole.TakeSmoothed(end);
  ASSERT_GT(smoothed.size(), 200u);
  double largest_m = 0.0;
  for (const SmoothedPose& pose : smoothed) {
    const Pose2 known_at_end = Inverse(*dive.track().Hindsight(pose.time, end)) * pose.given;
    EXPECT_LT((pose.smoothed.Vector() - known_at_end.Vector()).norm(), 1e-9);
    largest_m =
        std::max(largest_m, (pose.smoothed.Translation() - pose.given.Translation()).norm());
  }
  EXPECT_GT(largest_m, 0.25);

  NavTrack in_parts = dive.track();
  std::vector<SmoothedPose> parts = in_parts.TakeSmoothed(test::At(100.0));
  EXPECT_LE(parts.back().time, test::At(100.0));
  for (const SmoothedPose& pose : in_parts.TakeSmoothed(end)) parts.push_back(pose);
  EXPECT_TRUE(in_parts.TakeSmoothed(end).empty());
  ASSERT_EQ(parts.size(), smoothed.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(parts[i].time, smoothed[i].time);
    EXPECT_LT((parts[i].smoothed.Vector() - smoothed[i].smoothed.Vector()).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace seastitch
