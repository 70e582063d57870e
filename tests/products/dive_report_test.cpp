#include "products/report/dive_report.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kSpeedMps = 2.0;

TrackState At(double t_s, double north_m, double east_m, double yaw_rad) {
  TrackState state;
  state.time = FromUtime(1'700'000'000'000'000) + FromSeconds(t_s);
  state.p_map = {north_m, east_m, 10.0};
  state.rpy_rad = {0.0, 0.0, yaw_rad};
  return state;
}

// 1000 s to the north, at 10 Hz.
std::vector<TrackState> North() {
  std::vector<TrackState> track;
  for (int i = 0; i <= 10'000; ++i) track.push_back(At(0.1 * i, 0.2 * i, 0.0, kPi - 0.01));
  return track;
}

TEST(CompareNavigations, WhereTheSecondOneStartsIsNoDifference) {
  std::vector<TrackState> second;
  for (int i = 0; i <= 3000; ++i) {
    const double t_s = 0.033 + 0.3 * i;  // between the states of the other
    second.push_back(At(t_s, 500.0 + kSpeedMps * t_s, -80.0, kPi - 0.01));
  }
  const auto difference = CompareNavigations(North(), second, "given");
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->source, "given");
  EXPECT_NEAR(difference->max_m, 0.0, 1e-9);
  EXPECT_NEAR(difference->rms_m, 0.0, 1e-9);
  EXPECT_NEAR(difference->heading_mean_deg, 0.0, 1e-9);
  EXPECT_NEAR(difference->duration_s, 900.0, 0.2);
  EXPECT_NEAR(static_cast<double>(difference->states), 9000.0, 2.0);
}

// The second one drifts to the east by 1 % of the way, with a heading that is 2 degrees larger and
// on the other side of south.
TEST(CompareNavigations, AnEvenDriftHasItsRmsAndItsMaximum) {
  std::vector<TrackState> second = North();
  for (TrackState& state : second) {
    state.p_map.y() = 0.01 * state.p_map.x();
    state.rpy_rad.z() = WrapAngle(state.rpy_rad.z() + Deg2Rad(2.0));
  }
  const auto difference = CompareNavigations(North(), second, "dead_reckoning");
  ASSERT_TRUE(difference);
  EXPECT_NEAR(difference->max_m, 20.0, 1e-6);
  EXPECT_NEAR(difference->rms_m, 20.0 / std::sqrt(3.0), 0.01);
  EXPECT_NEAR(difference->heading_mean_deg, 2.0, 1e-6);
}

TEST(CompareNavigations, AGapOfTheSecondOneIsNotCompared) {
  std::vector<TrackState> second;
  for (const TrackState& state : North())
    if (state.p_map.x() < 200.0 || state.p_map.x() > 1000.0) second.push_back(state);
  const auto difference = CompareNavigations(North(), second, "given");
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->states, second.size());
  EXPECT_FALSE(CompareNavigations(North(), {}, "given"));
}

}  // namespace
}  // namespace seastitch
