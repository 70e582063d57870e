#include "mapper/noise/sonar_timing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/core/pose.hpp"

namespace seastitch {
namespace {

// A boat at 1.5 m/s whose roll, pitch and heave have different periods.
struct Boat {
  double roll_rad = Deg2Rad(2.0);
  double pitch_rad = Deg2Rad(1.0);
  double heave_m = 0.05;

  Eigen::Isometry3d At(Time time) const {
    const double t = ToSeconds(time - FromUtime(0));
    return MakePose({1.5 * t, 0.0, heave_m * std::sin(1.7 * t)},
                    RotationFromRpy(roll_rad * std::sin(1.1 * t + 0.4 * std::sin(0.3 * t)),
                                    pitch_rad * std::sin(0.9 * t),
                                    0.0));
  }
};

struct Seabed {
  double depth_m = 10.0;
  double along = 0.0;  // m/m
  double across = 0.0;
};

// Soundings of 64 beams in the plane of the sonar, computed with a pose that is late_s off.
GeoreferencedPing Ping(const Boat& boat,
                       const Seabed& seabed,
                       Time time,
                       double early_s,
                       double noise_m,
                       std::mt19937* random) {
  const Eigen::Isometry3d truth = boat.At(time + FromSeconds(early_s));
  GeoreferencedPing ping;
  ping.time = time;
  ping.T_map_vehicle = boat.At(time);
  std::normal_distribution<double> noise(0.0, noise_m);
  const Eigen::Vector3d normal(-seabed.along, -seabed.across, 1.0);
  for (int beam = 0; beam < 64; ++beam) {
    const double angle = Deg2Rad(-60.0 + 120.0 * beam / 63.0);
    const Eigen::Vector3d ray =
        truth.rotation() * Eigen::Vector3d(0.0, std::sin(angle), std::cos(angle));
    const double range = (seabed.depth_m - normal.dot(truth.translation())) / normal.dot(ray);
    const Eigen::Vector3d in_vehicle =
        (range + noise(*random)) * (truth.rotation().transpose() * ray);
    ping.soundings.push_back({ping.T_map_vehicle * in_vehicle, beam, 0.0f});
  }
  return ping;
}

void AddTo(SonarTiming* timing, const GeoreferencedPing& ping, const PoseLookup& pose_at) {
  timing->Add(ping, timing->RollBefore(ping, pose_at));
}

SonarTimingEstimate Estimate(const Boat& boat,
                             const Seabed& seabed,
                             double early_s,
                             int pings = 1000,
                             double noise_m = 0.05) {
  std::mt19937 random(1);
  SonarTiming timing;
  for (int i = 0; i < pings; ++i)
    AddTo(&timing,
          Ping(boat, seabed, FromUtime(i * 100'000), early_s, noise_m, &random),
          [&](Time t) { return boat.At(t); });
  return timing.estimate();
}

TEST(SonarTiming, FindsTheOffsetByRollOnASeabedThatIsFlat) {
  for (const double early_s : {-0.03, 0.0, 0.01, 0.1}) {
    const SonarTimingEstimate found = Estimate({}, {}, early_s);
    ASSERT_TRUE(found.roll);
    EXPECT_LT(found.roll->sigma_s, 0.005);
    EXPECT_NEAR(found.roll->add_s, early_s, 4.0 * found.roll->sigma_s + 0.02 * std::abs(early_s));
    EXPECT_LE(found.roll->change_after, found.roll->change_before);
  }
}

TEST(SonarTiming, FindsTheScaleOfRollBesideTheOffset) {
  for (const double add_percent : {-3.0, 0.0, 5.0}) {
    std::mt19937 random(2);
    const Boat truth;
    Boat stated;
    stated.roll_rad /= 1.0 + 0.01 * add_percent;
    SonarTiming timing;
    for (int i = 0; i < 3000; ++i) {
      const Time time = FromUtime(i * 100'000);
      GeoreferencedPing ping = Ping(truth, {}, time, 0.02, 0.05, &random);
      // The same beams, placed by the roll that is stated.
      const Eigen::Isometry3d T_stated_truth = stated.At(time) * ping.T_map_vehicle.inverse();
      for (Sounding& s : ping.soundings) s.p_map = T_stated_truth * s.p_map;
      ping.T_map_vehicle = stated.At(time);
      AddTo(&timing, ping, [&](Time t) { return stated.At(t); });
    }
    const SonarTimingEstimate found = timing.estimate();
    ASSERT_TRUE(found.roll_scale && found.roll);
    EXPECT_LT(found.roll_scale->sigma_percent, 0.6);
    EXPECT_NEAR(
        found.roll_scale->add_percent, add_percent, 3.0 * found.roll_scale->sigma_percent + 0.1);
    EXPECT_EQ(found.roll_scale->IsClear(), add_percent != 0.0);
    EXPECT_NEAR(found.roll->add_s, 0.02, 4.0 * found.roll->sigma_s + 0.001);
  }
}

// On one line the steering of beams looks like a scale of roll, of the size that reports state.
TEST(SonarTiming, TakesSteeringForAScaleOfRoll) {
  constexpr double kSteeringMps = 20.0;  // of SonarCalibration::smile_mps
  std::mt19937 random(4);
  const Boat boat;
  SonarTiming timing;
  for (int i = 0; i < 3000; ++i) {
    const Time time = FromUtime(i * 100'000);
    GeoreferencedPing ping = Ping(boat, {}, time, 0.0, 0.02, &random);
    for (Sounding& s : ping.soundings) {
      const Eigen::Vector3d beam = ping.T_map_vehicle.inverse() * s.p_map;
      const double range_m = beam.norm();
      const double sine = beam.y() / range_m / (1.0 + kSteeringMps / 1500.0);
      s.p_map = ping.T_map_vehicle *
                Eigen::Vector3d(0.0, range_m * sine, range_m * std::sqrt(1.0 - sine * sine));
    }
    AddTo(&timing, ping, [&](Time t) { return boat.At(t); });
  }
  const auto found = timing.estimate().roll_scale;
  ASSERT_TRUE(found);
  EXPECT_NEAR(std::abs(found->add_percent),
              kSteeringMps * RollScaleEstimate::kPercentOfSteeringMps,
              0.3 * kSteeringMps * RollScaleEstimate::kPercentOfSteeringMps)
      << found->add_percent << " +- " << found->sigma_percent;
}

// Sigma is consistent: over many surveys the errors divided by it have a standard deviation of 1.
TEST(SonarTiming, SigmaIsHonest) {
  double sum = 0.0;
  constexpr int kSurveys = 40;
  for (int seed = 0; seed < kSurveys; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const Boat boat;
    SonarTiming timing;
    for (int i = 0; i < 800; ++i)
      AddTo(&timing, Ping(boat, {}, FromUtime(i * 100'000), 0.02, 0.1, &random), [&](Time t) {
        return boat.At(t);
      });
    const auto found = timing.estimate().roll;
    ASSERT_TRUE(found);
    sum += std::pow((found->add_s - 0.02) / found->sigma_s, 2);
  }
  EXPECT_GT(sum / kSurveys, 0.4);
  EXPECT_LT(sum / kSurveys, 2.0);
}

TEST(SonarTiming, SaysNothingOfFewPingsOrOfAVehicleThatDoesNotRoll) {
  EXPECT_FALSE(Estimate({}, {}, 0.02, 100).roll);
  const auto still = Estimate({0.0, 0.0, 0.0}, {}, 0.02).roll;
  if (still) {
    EXPECT_GT(still->sigma_s, 0.05);
  }
}

// Both swaths of a dual swath have the time of the first.
TEST(SonarTiming, FindsTheOffsetOfADualSwath) {
  std::mt19937 random(5);
  const Boat boat;
  SonarTiming timing;
  for (int i = 0; i < 1000; ++i)
    for (int swath = 0; swath < 2; ++swath)
      AddTo(&timing, Ping(boat, {}, FromUtime(i * 100'000), 0.02, 0.05, &random), [&](Time t) {
        return boat.At(t);
      });
  const auto found = timing.estimate().roll;
  ASSERT_TRUE(found);
  EXPECT_LT(found->sigma_s, 0.005);
  EXPECT_NEAR(found->add_s, 0.02, 4.0 * found->sigma_s);
}

// A wreck under one ping in twenty, and pings without a pose, do not change the estimate.
TEST(SonarTiming, IsRobust) {
  std::mt19937 random(3);
  const Boat boat;
  SonarTiming timing;
  for (int i = 0; i < 2000; ++i) {
    GeoreferencedPing ping = Ping(boat, {}, FromUtime(i * 100'000), 0.02, 0.05, &random);
    if (i % 20 == 0)
      for (Sounding& s : ping.soundings)
        if (s.p_map.y() > 3.0) s.p_map.z() -= 2.0;
    AddTo(&timing, ping, [&](Time t) -> std::optional<Eigen::Isometry3d> {
      if (i % 100 == 7) return std::nullopt;
      return boat.At(t);
    });
  }
  const auto found = timing.estimate().roll;
  ASSERT_TRUE(found);
  EXPECT_LT(found->sigma_s, 0.01);
  EXPECT_NEAR(found->add_s, 0.02, 4.0 * found->sigma_s);
}

}  // namespace
}  // namespace seastitch
