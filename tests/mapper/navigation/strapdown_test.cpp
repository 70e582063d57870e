#include "mapper/navigation/filter/strapdown.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr double kLatitude = 0.9;

// An Earth that neither turns nor pulls.
EarthModel NoEarth() {
  EarthModel earth(kLatitude);
  earth.gravity_mps2.setZero();
  earth.rate_radps.setZero();
  return earth;
}

TEST(EarthModel, HasTheGravityAndRateOfItsLatitude) {
  EXPECT_NEAR(EarthModel(0.0).gravity_mps2.z(), 9.7803253359, 1e-9);
  EXPECT_NEAR(EarthModel(kPi / 2.0).gravity_mps2.z(), 9.8321849379, 1e-9);
  const EarthModel earth(kLatitude);
  EXPECT_NEAR(earth.rate_radps.norm(), 7.292115e-5, 1e-12);
  EXPECT_LT(earth.rate_radps.z(), 0.0);  // northern latitude: the axis points up
}

TEST(RotationVector, GoesThereAndBack) {
  for (const double angle : {0.0, 1e-12, 1e-6, 1e-3, 1.0, 3.0}) {
    const Eigen::Vector3d v = angle * Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
    const Eigen::Quaterniond q = QuaternionFromRotationVector(v);
    EXPECT_LT((RotationVectorFromQuaternion(q) - v).norm(), 1e-12);
    const Eigen::Quaterniond other_sign(-q.coeffs());
    EXPECT_LT((RotationVectorFromQuaternion(other_sign) - v).norm(), 1e-12);
  }
}

TEST(Strapdown, AtRestStaysAtRest) {
  const EarthModel earth(kLatitude);
  InertialState state;
  state.q_map_imu = Eigen::Quaterniond(RotationFromRpy(0.1, -0.2, 0.7));
  const InertialState start = state;
  for (int i = 0; i < 6000; ++i) {
    const InertialRates rates{state.q_map_imu.conjugate() * earth.rate_radps,
                              state.q_map_imu.conjugate() * -earth.gravity_mps2};
    state = Integrate(state, rates, rates, 0.01, earth);
  }
  EXPECT_LT(state.v_map_mps.norm(), 1e-6);
  EXPECT_LT(state.q_map_imu.angularDistance(start.q_map_imu), 1e-9);
}

// Coning: the axis of a rolling and pitching body goes round a cone and the body turns about it,
// though no gyro shows a mean rate about it. One step is held against a hundred along the same
// evenly changing rates, for two thousand steps at 200 Hz on a cone of 5 Hz.
TEST(Strapdown, HoldsTheConingTermOfEachStep) {
  constexpr double kRate = 2.0 * kPi * 5.0;
  constexpr double kAmplitude = 0.02 * kRate;
  constexpr double kDt = 0.005;
  const auto rates = [](double t) {
    return InertialRates{{kAmplitude * std::cos(kRate * t), kAmplitude * std::sin(kRate * t), 0.0},
                         {}};
  };
  const EarthModel earth = NoEarth();
  InertialState whole;
  InertialState fine;
  for (int i = 0; i < 2000; ++i) {
    const InertialRates from = rates(i * kDt);
    const InertialRates to = rates((i + 1) * kDt);
    whole = Integrate(whole, from, to, kDt, earth);
    const Eigen::Vector3d change = (to.angular_rate_radps - from.angular_rate_radps) / 100.0;
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3d middle = from.angular_rate_radps + (k + 0.5) * change;
      fine = Integrate(fine, {middle, {}}, {middle, {}}, kDt / 100.0, earth);
    }
  }
  // What leaving the term out would add up to: (w0 x dw) dt^2 / 12 a step.
  const double missing =
      2000.0 * kAmplitude * kAmplitude * std::sin(kRate * kDt) * kDt * kDt / 12.0;
  EXPECT_LT(whole.q_map_imu.angularDistance(fine.q_map_imu), 0.01 * missing);
}

// Sculling: a body that rocks and surges in phase is pushed steadily, though neither sensor shows a
// mean.
TEST(Strapdown, FollowsAScullingMotion) {
  constexpr double kAngle = 0.05;
  constexpr double kSurge = 2.0;
  constexpr double kRate = 2.0 * kPi * 2.0;
  const auto rates = [](double t) {
    return InertialRates{{0.0, kAngle * kRate * std::cos(kRate * t), 0.0},
                         {kSurge * std::sin(kRate * t), 0.0, 0.0}};
  };
  InertialState state;
  const EarthModel earth = NoEarth();
  for (int i = 0; i < 1000; ++i)
    state = Integrate(state, rates(i * 0.01), rates((i + 1) * 0.01), 0.01, earth);
  // Mean of -sin(angle sin) surge sin over whole cycles: -surge J1(angle).
  const double expected = -10.0 * kSurge * std::cyl_bessel_j(1.0, kAngle);
  EXPECT_NEAR(state.v_map_mps.z(), expected, 0.01 * std::abs(expected));
}

TEST(Strapdown, FeelsTheEarthTurnUnderAMovingBody) {
  EarthModel earth(kLatitude);
  earth.gravity_mps2.setZero();
  InertialState state;
  state.v_map_mps = {1.0, 0.0, 0.0};
  for (int i = 0; i < 100; ++i) {
    const InertialRates rates{state.q_map_imu.conjugate() * earth.rate_radps, {0.0, 0.0, 0.0}};
    state = Integrate(state, rates, rates, 0.1, earth);
  }
  // North-going, northern hemisphere: to the right, 2 omega sin(latitude) v.
  EXPECT_NEAR(state.v_map_mps.y(), 2.0 * 7.292115e-5 * std::sin(kLatitude) * 10.0, 1e-6);
}

}  // namespace
}  // namespace seastitch
