#include "tests/mapper/registration/registration_fixtures.hpp"

namespace seastitch {
namespace {

// Normalised error squared, a degree of freedom, over pairs; no error is shared here, so none is
// allowed for. pair_of: SyntheticPair(seed).
template <class PairOf>
double MeanNees(PairOf pair_of, int draws) {
  RegistrationParams params;
  params.noise = {1.0, 0.0, 0.0, 0.0};
  params.min_position_sigma_m = 0.0;
  double sum = 0.0;
  int accepted = 0;
  for (int draw = 0; draw < draws; ++draw) {
    const SyntheticPair pair = pair_of(static_cast<std::uint64_t>(draw));
    const Prior prior = PriorAround(pair.T_target_source, 1.5, Deg2Rad(1.0), draw);
    const RegistrationResult result = RegisterPair(pair, prior, params);
    if (result.verdict != LoopVerdict::kAccepted) continue;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    sum += error.dot(result.information * error) / result.known_directions;
    ++accepted;
  }
  EXPECT_GT(accepted, draws * 2 / 3);
  return sum / accepted;
}

double MeanNees(double relief_m, double sounding_sigma_m, int draws) {
  SyntheticPairParams shape;
  shape.sounding_sigma_m = sounding_sigma_m;
  return MeanNees(
      [&](std::uint64_t seed) {
        return MakePair(SyntheticSeabed::Fractal(seed, relief_m), shape, seed);
      },
      draws);
}

TEST(RegistrationCovariance, IsHonestOnHighRelief) {
  EXPECT_THAT(MeanNees(1.0, 0.05, 40), ::testing::AllOf(::testing::Gt(0.5), ::testing::Lt(2.0)));
}
TEST(RegistrationCovariance, IsHonestOnLowRelief) {
  EXPECT_THAT(MeanNees(0.3, 0.05, 40), ::testing::AllOf(::testing::Gt(0.5), ::testing::Lt(2.0)));
}
TEST(RegistrationCovariance, IsHonestUnderLoudNoise) {
  EXPECT_THAT(MeanNees(0.4, 0.2, 40), ::testing::AllOf(::testing::Gt(0.5), ::testing::Lt(2.0)));
}

// What a multibeam 8 m above the seabed hears along 17 m: soundings in rows, ten times as dense
// below as at the rims, and noise along the beam.
SyntheticSubmap SampleSwath(const SyntheticSeabed& seabed,
                            const Pose2& middle,
                            double range_sigma_m,
                            std::mt19937_64* random) {
  constexpr int kPings = 31;
  constexpr int kBeams = 134;
  constexpr double kPingSpacingM = 0.55;
  constexpr double kAltitudeM = 8.0;
  std::normal_distribution<double> noise(0.0, range_sigma_m);
  SyntheticSubmap out{
      {}, MakePose({middle.x, middle.y, -kAltitudeM}, RotationFromRpy(0, 0, middle.yaw)), middle};
  for (int ping = 0; ping < kPings; ++ping) {
    for (int beam = 0; beam < kBeams; ++beam) {
      const double angle = Deg2Rad(-66.0 + 132.0 * beam / (kBeams - 1));
      Eigen::Vector3d p((ping - kPings / 2) * kPingSpacingM, 0.0, kAltitudeM);
      for (int i = 0; i < 4; ++i) {  // the beam meets the seabed
        p.y() = p.z() * std::tan(angle);
        const Eigen::Vector2d on_map = middle * p.head<2>();
        p.z() = kAltitudeM + seabed.HeightAt(on_map.x(), on_map.y());
      }
      p += noise(*random) * Eigen::Vector3d(0.0, std::sin(angle), std::cos(angle));
      out.cloud.Add(p.cast<float>());
    }
  }
  return out;
}

// Two legs against each other that share the outer part of their swaths.
TEST(RegistrationCovariance, IsHonestForTheBeamsOfASwath) {
  const auto pair_of = [](std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    const SyntheticSeabed seabed = SyntheticSeabed::Fractal(seed, 0.1, 2.0);
    const Pose2 there{20.0 * unit(random), 20.0 * unit(random), 2.0 * kPi * unit(random)};
    const Pose2 back = there * Pose2{4.0 * unit(random), 22.0, 0.1 * unit(random) + kPi};
    SyntheticPair pair{SampleSwath(seabed, there, 0.028, &random),
                       SampleSwath(seabed, back, 0.028, &random),
                       Inverse(there) * back,
                       0.0};
    return pair;
  };
  EXPECT_THAT(MeanNees(pair_of, 40), ::testing::AllOf(::testing::Gt(0.5), ::testing::Lt(2.0)));
}

TEST(Registration, SwappingTargetAndSourceGivesTheInverse) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(seed, 0.6), {}, seed);
    const Prior prior = PriorAround(pair.T_target_source, 2.0, Deg2Rad(1.0), 0.5);
    SyntheticPair swapped = pair;
    std::swap(swapped.target, swapped.source);
    swapped.z_prior_m = -pair.z_prior_m;
    const Pose2 inverse = Inverse(prior.T_target_source);
    const Eigen::Matrix3d covariance = RelativeCovariance(prior.T_target_source,
                                                          Pose2{},
                                                          prior.covariance,
                                                          Eigen::Matrix3d::Zero(),
                                                          Eigen::Matrix3d::Zero());
    const RegistrationResult there = RegisterPair(pair, prior);
    const RegistrationResult back =
        RegisterPair(swapped, {inverse, 0.5 * (covariance + covariance.transpose())});
    ASSERT_EQ(there.verdict, LoopVerdict::kAccepted);
    ASSERT_EQ(back.verdict, LoopVerdict::kAccepted);
    const Pose2 loop = there.T_target_source * back.T_target_source;
    EXPECT_LT(loop.Translation().norm(), 0.08) << seed;
    EXPECT_LT(std::abs(loop.yaw), Deg2Rad(0.15)) << seed;
    EXPECT_NEAR(there.z_offset_m, -back.z_offset_m, 0.01) << seed;
  }
}

TEST(Registration, AFewWildPointsChangeNothing) {
  SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(5, 0.6), {}, 5);
  const Prior prior = PriorAround(pair.T_target_source, 2.0, Deg2Rad(1.0), 0.5);
  const RegistrationResult clean = RegisterPair(pair, prior);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  pair.source.cloud.Add({nan, 0.0f, 0.0f});
  pair.source.cloud.Add({0.0f, 0.0f, std::numeric_limits<float>::infinity()});
  pair.source.cloud.Add({5e4f, -3e5f, 10.0f});
  pair.source.cloud.Add({1e30f, 1e30f, 1e30f});
  pair.source.cloud.Add({0.0f, 0.0f, 0.0f}, nan);
  pair.source.cloud.Add({0.0f, 0.0f, 0.0f}, -1.0f);
  const RegistrationResult wild = RegisterPair(pair, prior);
  ASSERT_EQ(clean.verdict, LoopVerdict::kAccepted);
  EXPECT_EQ(wild.verdict, LoopVerdict::kAccepted);
  EXPECT_LT(ErrorOf(wild.T_target_source, clean.T_target_source).norm(), 0.01);
}

TEST(Registration, ASchoolOfFishInOneSubmapMovesLittle) {
  SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(6, 0.6), {}, 6);
  const Prior prior = PriorAround(pair.T_target_source, 2.0, Deg2Rad(1.0), 0.5);
  std::mt19937_64 random(1);
  std::normal_distribution<double> spread(0.0, 1.5);
  const Eigen::Vector3f middle = pair.target.cloud.points.front();
  for (int i = 0; i < 100; ++i) {
    const double y = spread(random);  // before x, on every processor
    pair.target.cloud.Add(middle + Eigen::Vector3d(spread(random), y, -3.0).cast<float>());
  }
  const RegistrationResult result = RegisterPair(pair, prior);
  const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
  EXPECT_LT(error.head<2>().norm(), 0.2);
  EXPECT_LT(std::abs(error[2]), Deg2Rad(0.6));
}

TEST(Registration, RefusesCloudsWithNothingToRegister) {
  const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(1, 0.6), {}, 1);
  const RegistrationSubmap good = Prepare(pair.target);
  ASSERT_FALSE(good.empty());
  std::vector<PointCloud> hostile(6);
  hostile[1].Add({1.0f, 2.0f, 3.0f});
  for (int i = 0; i < 100; ++i) hostile[2].Add({1.0f, 2.0f, 3.0f});
  for (int i = 0; i < 100; ++i) hostile[3].Add({static_cast<float>(i), 0.0f, 10.0f});
  for (int i = 0; i < 100; ++i) hostile[4].Add({static_cast<float>(i) * 1e4f, 0.0f, 1.0f}, 1e8f);
  for (int i = 0; i < 100; ++i) hostile[5].Add(Eigen::Vector3f::Constant(std::nanf("")));
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
  for (const PointCloud& cloud : hostile) {
    const RegistrationSubmap bad =
        RegistrationSubmap::Prepare(cloud, Eigen::Matrix3d::Identity(), {});
    for (const auto& [a, b] : {std::pair{&good, &bad}, {&bad, &good}, {&bad, &bad}}) {
      const RegistrationResult result = Align(*a, *b, {{}, covariance, 0.0, 1.0});
      EXPECT_NE(result.verdict, LoopVerdict::kAccepted);
      EXPECT_TRUE(result.information.isZero());
      EXPECT_TRUE(result.T_target_source.Vector().allFinite());
    }
  }
}

TEST(Registration, RefusesPriorsThatAreNone) {
  const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(1, 0.6), {}, 1);
  const RegistrationSubmap target = Prepare(pair.target);
  const RegistrationSubmap source = Prepare(pair.source);
  const double nan = std::nan("");
  const Eigen::Matrix3d good = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
  const auto refused = [&](const Pose2& T, const Eigen::Matrix3d& C, double z, double z_sigma) {
    return Align(target, source, {T, C, z, z_sigma}).verdict == LoopVerdict::kNotConverged;
  };
  const Pose2& truth = pair.T_target_source;
  EXPECT_FALSE(refused(truth, good, pair.z_prior_m, 0.5));
  EXPECT_TRUE(refused({nan, 0.0, 0.0}, good, 0.0, 0.5));
  EXPECT_TRUE(refused({1e12, 0.0, 0.0}, good, 0.0, 0.5));
  EXPECT_TRUE(refused(truth, nan * good, 0.0, 0.5));
  EXPECT_TRUE(refused(truth, Eigen::Matrix3d::Zero(), 0.0, 0.5));
  EXPECT_TRUE(refused(truth, -good, 0.0, 0.5));
  EXPECT_TRUE(refused(truth, good, nan, 0.5));
  EXPECT_TRUE(refused(truth, good, 0.0, 0.0));
  EXPECT_TRUE(refused(truth, good, 0.0, nan));
}

TEST(Registration, SaysLittleOverlapWhereTheTwoDoNotMeet) {
  const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(1, 0.6), {}, 1);
  Prior prior = PriorAround(pair.T_target_source, 1.0, 0.01, 0.0);
  prior.T_target_source.x += 500.0;
  EXPECT_EQ(RegisterPair(pair, prior).verdict, LoopVerdict::kLittleOverlap);
}

TEST(Registration, GivesTheSameBytesInEveryRunAndThread) {
  const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(2, 0.6), {}, 2);
  const Prior prior = PriorAround(pair.T_target_source, 4.0, Deg2Rad(2.0), 0.5);
  std::vector<RegistrationResult> results(4);
  std::vector<std::thread> threads;
  for (RegistrationResult& result : results)
    threads.emplace_back([&] { result = RegisterPair(pair, prior); });
  for (std::thread& thread : threads) thread.join();
  for (const RegistrationResult& result : results) {
    EXPECT_EQ(
        std::memcmp(result.information.data(), results[0].information.data(), 9 * sizeof(double)),
        0);
    EXPECT_EQ(result.T_target_source.Vector(), results[0].T_target_source.Vector());
  }
}

}  // namespace
}  // namespace seastitch
