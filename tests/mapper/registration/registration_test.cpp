#include "mapper/registration/registration.hpp"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <thread>
#include <utility>

#include "bench/terrain.hpp"
#include "tests/mapper/registration/synthetic_pair.hpp"

namespace seastitch {
namespace {

struct Prior {
  Pose2 T_target_source;
  Eigen::Matrix3d covariance;
};

// Off by `offset_m` in a direction of its own and by `yaw_rad`, both at 2 sigma of what it claims.
Prior PriorAround(const Pose2& truth, double offset_m, double yaw_rad, double direction_rad) {
  Prior prior{truth, Eigen::Matrix3d::Zero()};
  prior.T_target_source.x += offset_m * std::cos(direction_rad);
  prior.T_target_source.y += offset_m * std::sin(direction_rad);
  prior.T_target_source.yaw += yaw_rad;
  const double sigma = std::max(0.2, 0.5 * offset_m);
  const double sigma_yaw = std::max(0.005, 0.5 * std::abs(yaw_rad));
  prior.covariance.diagonal() << sigma * sigma, sigma * sigma, sigma_yaw * sigma_yaw;
  return prior;
}

RegistrationSubmap Prepare(const SyntheticSubmap& submap, const RegistrationParams& params = {}) {
  return RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params);
}

RegistrationResult RegisterPair(const SyntheticPair& pair,
                                const Prior& prior,
                                const RegistrationParams& params = {}) {
  return Align(Prepare(pair.target, params),
               Prepare(pair.source, params),
               {prior.T_target_source, prior.covariance, pair.z_prior_m, 0.5},
               params);
}

Eigen::Vector3d ErrorOf(const Pose2& estimate, const Pose2& truth) {
  Eigen::Vector3d e = estimate.Vector() - truth.Vector();
  e[2] = WrapAngle(e[2]);
  return e;
}

TEST(Registration, FindsTheSourceAcrossShiftTurnAndHeightBias) {
  SyntheticPairParams shape;
  shape.z_bias_m = 0.3;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(seed, 0.6), shape, seed);
    const Prior prior = PriorAround(pair.T_target_source,
                                    2.0 * static_cast<double>(seed),
                                    Deg2Rad(seed % 2 == 0 ? 5.0 : -5.0),
                                    static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict) << seed;
    EXPECT_EQ(result.known_directions, 3);
    EXPECT_LT(error.head<2>().norm(), 0.15) << seed;
    EXPECT_LT(std::abs(error[2]), Deg2Rad(0.4)) << seed;
    EXPECT_NEAR(result.z_offset_m, 0.3, 0.03) << seed;
    EXPECT_LT((result.overlap_center_m - OverlapCenter(pair)).norm(), 2.0) << seed;
  }
}

// On a slope the height and the position belong together: where the position's step alone is
// damped, the residuals jump and ten of these twelve pairs never converge.
TEST(Registration, ConvergesOnASlope) {
  SyntheticPairParams shape;
  shape.sounding_sigma_m = 0.02;
  shape.points = 20'000;
  shape.overlap = 0.5;
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const SyntheticSeabed seabed =
        SyntheticSeabed::Fractal(seed, 0.05, 8.0, 80.0).OnASlope({0.6, -0.36});
    const SyntheticPair pair = MakePair(seabed, shape, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 8.0, Deg2Rad(2.0), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    EXPECT_NE(result.verdict, LoopVerdict::kNotConverged) << seed;
    if (result.verdict != LoopVerdict::kAccepted) continue;
    ++accepted;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_LT(error.dot(result.information * error), 16.3) << seed;
  }
  EXPECT_GE(accepted, 11);
}

// The height is that of the delivered pose, not of the one before the prior was taken out: an error
// d of the pose shifts the height by slope * d.
TEST(Registration, StatesTheHeightOfThePoseItDelivers) {
  SyntheticPairParams shape;
  shape.z_bias_m = 0.2;
  shape.overlap = 0.5;
  const Eigen::Vector2d slope(0.4, -0.3);
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const SyntheticSeabed seabed = SyntheticSeabed::Fractal(seed, 0.1).OnASlope(slope);
    const SyntheticPair pair = MakePair(seabed, shape, seed);
    // A prior that is as certain as the soundings, and wrong by 0.2 m up or down the slope.
    Prior prior = PriorAround(pair.T_target_source, 0.0, 0.0, 0.0);
    const Eigen::Matrix2d R_map_target = LevelPose(pair.target.T_map_submap).Rotation();
    const Eigen::Vector2d off =
        R_map_target.transpose() * slope.normalized() * (seed % 2 == 0 ? 0.2 : -0.2);
    prior.T_target_source.x += off.x();
    prior.T_target_source.y += off.y();
    prior.covariance.diagonal() << 0.01, 0.01, 1e-6;
    const RegistrationResult result = RegisterPair(pair, prior);
    if (result.verdict != LoopVerdict::kAccepted) continue;
    ++accepted;
    const Eigen::Vector2d center = OverlapCenter(pair);
    const Eigen::Vector2d of_source = Inverse(pair.T_target_source) * center;
    const Eigen::Vector2d d = R_map_target * (result.T_target_source * of_source - center);
    EXPECT_NEAR(result.z_offset_m, 0.2 - slope.dot(d), 0.004) << seed;
  }
  EXPECT_GE(accepted, 6);
}

// Cells at the rim of a narrow overlap enter and leave it: full steps then turn back and forth for
// ever. Without damping two of these twelve pairs never converge.
TEST(Registration, ConvergesOnANarrowOverlap) {
  SyntheticPairParams shape;
  shape.sounding_sigma_m = 0.01;
  shape.overlap = 0.15;
  shape.points = 3'000;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(seed, 0.05), shape, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 1.0, Deg2Rad(1.0), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict) << seed;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_LT(error.dot(result.information * error), 16.3) << seed;
  }
}

// Of `pairs` pairs, by how much the source is put too far off, across the overlap. Mean and sigma
// of the mean.
std::pair<double, double> DrawnApart(int pairs,
                                     double relief_m,
                                     const SyntheticPairParams& params) {
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(pairs); ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(seed, relief_m), params, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 0.5, Deg2Rad(0.5), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    const Pose2 middle = Inverse(LevelPose(pair.target.T_map_submap)) * pair.source.T_map_middle;
    const Pose2 target_middle =
        Inverse(LevelPose(pair.target.T_map_submap)) * pair.target.T_map_middle;
    // Seen from the target's middle, the source lies across its y axis.
    const Eigen::Vector2d apart =
        Eigen::Vector2d(middle.Translation() - target_middle.Translation());
    const Eigen::Vector2d across = target_middle.Rotation().col(1) *
                                   (apart.dot(target_middle.Rotation().col(1)) < 0.0 ? -1.0 : 1.0);
    const Pose2 found = result.T_target_source * Inverse(pair.T_target_source) * middle;
    const double error = across.dot(found.Translation() - middle.Translation());
    sum += error;
    squares += error * error;
  }
  const double mean = sum / pairs;
  return {mean, std::sqrt((squares / pairs - mean * mean) / pairs)};
}

// At the rims of the submaps, which lie on opposite sides of the overlap, the errors of heights and
// slopes are correlated: left in, that draws every pair together, where relief is below the noise
// by a decimetre.
TEST(Registration, NoiseDoesNotDrawSubmapsTogether) {
  const auto [mean, sigma] = DrawnApart(80, 0.05, {});
  EXPECT_LT(std::abs(mean), 3.0 * sigma);
  EXPECT_LT(sigma, 0.03);  // or it would say nothing
}

// As that of the outer beams does: to four times from the middle of the swath to its rims. Taken
// for the same everywhere it draws these pairs together by 0.23 m; 0.05 m are left.
TEST(Registration, NoiseThatGrowsTowardsTheRimsDrawsThemTogetherByLittle) {
  SyntheticPairParams swath;
  swath.sounding_sigma_m = 0.03;
  swath.rim_factor = 4.0;
  const auto [mean, sigma] = DrawnApart(200, 0.1, swath);
  EXPECT_LT(std::abs(mean), 0.1);
  EXPECT_LT(sigma, 0.02);  // or it would say nothing
}

TEST(Registration, GivesNoEdgeOnAFlatSeabed) {
  SyntheticPairParams shape;
  shape.points = 2500;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Flat(), shape, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 3.0, Deg2Rad(1.0), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    EXPECT_NE(result.verdict, LoopVerdict::kAccepted) << seed;
    EXPECT_TRUE(result.information.isZero()) << seed;
  }
}

TEST(Registration, RidgesInformOnlyAcrossThem) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const double across_map = 0.7 * static_cast<double>(seed);
    const SyntheticPair pair = MakePair(SyntheticSeabed::Ridges(seed, 0.5, across_map), {}, seed);
    const Prior prior = PriorAround(pair.T_target_source, 1.5, Deg2Rad(1.0), across_map);
    const RegistrationResult result = RegisterPair(pair, prior);
    ASSERT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict) << seed;
    EXPECT_EQ(result.known_directions, 2) << seed;
    const double across = across_map - LevelPose(pair.target.T_map_submap).yaw;
    const Eigen::Vector2d u(std::cos(across), std::sin(across));
    const Eigen::Vector2d along(-u.y(), u.x());
    const Eigen::Matrix2d information = result.information.topLeftCorner<2, 2>();
    EXPECT_GT(u.dot(information * u), 100.0) << seed;
    EXPECT_LT(along.dot(information * along), 0.01 * u.dot(information * u)) << seed;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_LT(error.dot(result.information * error), 25.0) << seed;
  }
}

struct BenchSeabed {
  bench::ProceduralTerrain terrain;
  std::optional<double> HeightAt(double x, double y) const { return terrain.DepthAt(x, y); }
};

// Where a pipe lies along itself is open by tens of metres, and its direction is known to a degree
// or so: what is said across it has to hold at its other end as well.
TEST(Registration, APipeFarAlongItselfDoesNotContradictTheTruth) {
  bench::ProceduralParams params;
  params.depth_m = 15.0;
  params.relief.rms_m = 0.02;
  params.pipeline.diameter_m = 0.5;
  params.pipeline.heading_deg = 60.0;
  int accepted = 0;
  for (std::uint64_t seed = 50; seed < 60; ++seed) {
    const BenchSeabed seabed{bench::ProceduralTerrain(params, seed)};
    const SyntheticPair pair = MakePair(seabed, {}, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 16.0, Deg2Rad(5.0), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    if (result.verdict != LoopVerdict::kAccepted) continue;
    ++accepted;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_LT(error.dot(result.information * error), 30.7) << seed;
  }
  EXPECT_GE(accepted, 5);
}

// 4.5 sigma off: navigation is worse than it claims, and the seabed says so beyond doubt.
TEST(Registration, BelievesAClearSeabedBeforeANavigationThatClaimsTooMuch) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::Fractal(seed, 0.6), {}, seed);
    Prior prior = PriorAround(pair.T_target_source, 4.5, 0.0, static_cast<double>(seed));
    prior.covariance.topLeftCorner<2, 2>() = Eigen::Matrix2d::Identity();
    const RegistrationResult result = RegisterPair(pair, prior);
    EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict) << seed;
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    EXPECT_LT(error.head<2>().norm(), 0.15) << seed;
  }
}

TEST(Registration, RefusesASeabedThatRepeatsItself) {
  int ambiguous = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::EggBox(6.0, 0.3), {}, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 6.0, Deg2Rad(0.5), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    EXPECT_NE(result.verdict, LoopVerdict::kAccepted) << seed;
    ambiguous += result.verdict == LoopVerdict::kAmbiguous;
  }
  EXPECT_GE(ambiguous, 8);
}

// Crests 12 m apart in a window of 48 m: what is accepted lies on the right crest.
TEST(Registration, AcceptsNoPlaceAWavelengthOffAmongSandWaves) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const SyntheticPair pair = MakePair(SyntheticSeabed::EggBox(12.0, 0.3), {}, seed);
    const Prior prior =
        PriorAround(pair.T_target_source, 16.0, Deg2Rad(2.0), static_cast<double>(seed));
    const RegistrationResult result = RegisterPair(pair, prior);
    const Eigen::Vector3d error = ErrorOf(result.T_target_source, pair.T_target_source);
    // Zero unless accepted.
    EXPECT_LT(error.dot(result.information * error), 30.0) << seed;
  }
}

TEST(Registration, TheSameRepeatingSeabedIsClearWithinHalfItsWavelength) {
  const SyntheticPair pair = MakePair(SyntheticSeabed::EggBox(12.0, 0.3), {}, 3);
  const Prior prior = PriorAround(pair.T_target_source, 1.0, Deg2Rad(0.5), 1.0);
  const RegistrationResult result = RegisterPair(pair, prior);
  EXPECT_EQ(result.verdict, LoopVerdict::kAccepted) << ToString(result.verdict);
  EXPECT_LT(ErrorOf(result.T_target_source, pair.T_target_source).head<2>().norm(), 0.15);
}

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
