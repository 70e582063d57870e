#include "mapper/geometry/calibrated_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

const Time kStart = FromUtime(1'700'000'000'000'000);

// Rolls, pitches, turns and sinks evenly.
std::optional<Eigen::Isometry3d> Moving(Time t) {
  const double s = ToSeconds(t - kStart);
  return MakePose({2.0 * s, -s, 5.0 + 0.5 * s},
                  RotationFromRpy(0.04 + 0.02 * s, 0.01 * s, 0.1 * s));
}

TEST(CalibratedPoses, ChangesWhatEachValueSaysAndNothingElse) {
  struct Case {
    SonarCalibration calibration;
    double heave_m;
    Eigen::Vector3d p;
    Eigen::Vector3d rpy;
  };
  const Case cases[] = {
      {{}, 0.3, {20.0, -10.0, 10.0}, {0.24, 0.1, 1.0}},
      {{.roll_rad = 0.01}, 0.3, {20.0, -10.0, 10.0}, {0.25, 0.1, 1.0}},
      {{.smile_mps = 7.0}, 0.3, {20.0, -10.0, 10.0}, {0.24, 0.1, 1.0}},
      {{.attitude_latency_ms = 200.0}, 0.3, {20.0, -10.0, 10.0}, {0.244, 0.102, 1.02}},
      {{.depth_latency_ms = -200.0}, 0.3, {20.0, -10.0, 9.9}, {0.24, 0.1, 1.0}},
      {{.roll_scale_percent = 5.0}, 0.3, {20.0, -10.0, 10.0}, {0.252, 0.1, 1.0}},
      {{.heave_scale_percent = 10.0}, 0.3, {20.0, -10.0, 10.03}, {0.24, 0.1, 1.0}},
  };
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    const auto pose =
        CalibratedPoses(Moving, cases[i].calibration, cases[i].heave_m)(kStart + FromSeconds(10.0));
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->translation() - cases[i].p).norm(), 1e-9) << i;
    EXPECT_LT((RpyFromRotation(pose->linear()) - cases[i].rpy).norm(), 1e-9) << i;
  }
}

TEST(CalibratedPoses, NeedThePosesOfTheirLatencies) {
  const PoseLookup until_now = [](Time t) -> std::optional<Eigen::Isometry3d> {
    return t <= kStart ? Moving(t) : std::nullopt;
  };
  EXPECT_TRUE(CalibratedPoses(until_now, {.depth_latency_ms = -30.0}, 0.0)(kStart));
  EXPECT_FALSE(CalibratedPoses(until_now, {.depth_latency_ms = 30.0}, 0.0)(kStart));
  EXPECT_EQ(LooksAhead({.attitude_latency_ms = 20.0, .depth_latency_ms = 30.0}), FromSeconds(0.03));
  EXPECT_EQ(LooksAhead({.attitude_latency_ms = -20.0}), FromSeconds(0.0));
}

TEST(SwathCorrectionOf, IsAPartOf1500MetresPerSecond) {
  EXPECT_EQ(SwathCorrectionOf({}).smile, 0.0);
  EXPECT_NEAR(SwathCorrectionOf({.smile_mps = 3.0}).smile, 0.002, 1e-12);
  EXPECT_NEAR(SwathCorrectionOf({.smile_by_water_mps = 1.5}).by_water, 0.001, 1e-12);
}

TEST(HeaveFilter, PassesWavesAndFollowsDepth) {
  HeaveFilter filter;
  double largest_m = 0.0, error_m = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double s = 0.1 * i;
    const double wave_m = 0.2 * std::sin(2.0 * kPi * s / 6.0);
    const double heave_m = filter.Add(kStart + FromSeconds(s), 20.0 + wave_m);
    if (s < 100.0) continue;
    largest_m = std::max(largest_m, heave_m);
    error_m = std::max(error_m, std::abs(heave_m - wave_m));
  }
  EXPECT_NEAR(largest_m, 0.2, 0.002);
  EXPECT_LT(error_m, 0.2 * 0.06);  // a phase of 3 degrees
  // The same time again, an earlier one, and a gap.
  const Time end = kStart + FromSeconds(399.9);
  const double last_m = filter.Add(end, 25.0);
  EXPECT_EQ(filter.Add(end, 30.0), last_m);
  EXPECT_EQ(filter.Add(end - FromSeconds(5.0), 30.0), last_m);
  EXPECT_EQ(filter.Add(end + FromSeconds(100.0), 30.0), 0.0);
}

}  // namespace
}  // namespace seastitch
