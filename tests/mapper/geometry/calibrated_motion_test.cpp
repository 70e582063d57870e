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
    const auto pose = CalibratedPoses(
        Moving, cases[i].calibration, 0, cases[i].heave_m)(kStart + FromSeconds(10.0));
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->translation() - cases[i].p).norm(), 1e-9) << i;
    EXPECT_LT((RpyFromRotation(pose->linear()) - cases[i].rpy).norm(), 1e-9) << i;
  }
}

TEST(CalibratedPoses, TurnsEachHeadByItsOwnRoll) {
  const SonarCalibration calibration{.roll_rad = 0.01, .second_head_roll_rad = -0.02};
  for (const auto& [head, roll_rad] :
       {std::pair{0, 0.25}, std::pair{1, 0.22}, std::pair{2, 0.25}}) {
    const auto pose = CalibratedPoses(
        Moving, calibration, static_cast<std::uint8_t>(head), 0.0)(kStart + FromSeconds(10.0));
    EXPECT_NEAR(RpyFromRotation(pose->linear()).x(), roll_rad, 1e-9) << head;
  }
}

TEST(CalibratedPoses, NeedThePosesOfTheirLatencies) {
  const PoseLookup until_now = [](Time t) -> std::optional<Eigen::Isometry3d> {
    return t <= kStart ? Moving(t) : std::nullopt;
  };
  EXPECT_TRUE(CalibratedPoses(until_now, {.depth_latency_ms = -30.0}, 0, 0.0)(kStart));
  EXPECT_FALSE(CalibratedPoses(until_now, {.depth_latency_ms = 30.0}, 0, 0.0)(kStart));
  EXPECT_EQ(LooksAhead({.attitude_latency_ms = 20.0, .depth_latency_ms = 30.0}), FromSeconds(0.03));
  EXPECT_EQ(LooksAhead({.attitude_latency_ms = -20.0}), FromSeconds(0.0));
  EXPECT_EQ(LooksAhead({.heave_scale_percent = 1.0}), FromSeconds(10.0));
}

TEST(SwathCorrectionOf, IsAPartOf1500MetresPerSecond) {
  EXPECT_EQ(SwathCorrectionOf({}).smile, 0.0);
  EXPECT_NEAR(SwathCorrectionOf({.smile_mps = 3.0}).smile, 0.002, 1e-12);
  EXPECT_NEAR(SwathCorrectionOf({.smile_by_water_mps = 1.5}).by_water, 0.001, 1e-12);
}

TEST(HeaveAt, IsTheWavesAndNotTheTerrain) {
  const auto wave_m = [](double s) { return 0.2 * std::sin(2.0 * kPi * s / 6.0); };
  std::vector<DepthAt> track;
  const PoseLookup pose_at = [&](Time t) -> std::optional<Eigen::Isometry3d> {
    const double s = ToSeconds(t - kStart);
    if (s < 0.0 || s > 100.0) return std::nullopt;
    // Down a slope, and over a hill that takes three minutes.
    const double depth_m = 20.0 + 0.3 * s + 2.0 * std::sin(2.0 * kPi * s / 180.0);
    return MakePose({0.0, 0.0, depth_m + wave_m(s)}, Eigen::Matrix3d::Identity());
  };
  for (int i = 0; i <= 1000; ++i) {
    const Time t = kStart + FromSeconds(0.1 * i);
    track.push_back({t, pose_at(t)->translation().z()});
  }
  for (const double s : {15.0, 47.3, 80.0}) {
    const Time t = kStart + FromSeconds(s);
    EXPECT_NEAR(HeaveAt(track, t), wave_m(s), 0.05) << s;
    EXPECT_NEAR(HeaveAt(pose_at, t), HeaveAt(track, t), 0.01) << s;
  }
  EXPECT_EQ(HeaveAt(track, kStart - FromSeconds(60.0)), 0.0);
  EXPECT_LT(std::abs(HeaveAt(track, kStart + FromSeconds(100.0))), 0.3);  // half a window
}

}  // namespace
}  // namespace seastitch
