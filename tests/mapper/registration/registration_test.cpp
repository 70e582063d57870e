#include "tests/mapper/registration/registration_fixtures.hpp"

namespace seastitch {
namespace {

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

}  // namespace
}  // namespace seastitch
