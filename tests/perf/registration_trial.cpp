#include "tests/perf/registration_trial.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <ctime>
#include <random>
#include <stdexcept>
#include <utility>

#include "bench/terrain_raster.hpp"

namespace seastitch {
namespace {

constexpr double kDepthM = 15.0;
constexpr double kRasterReachM = 3000.0;
constexpr double kPairReachM = 60.0;  // from the middle of a pair to its furthest point

SeabedClass Procedural(std::string name, const bench::ProceduralParams& params) {
  return {std::move(name), [params](std::uint64_t seed) {
            return Site{std::make_shared<bench::ProceduralTerrain>(params, seed)};
          }};
}

bool IsKnownAround(const bench::Terrain& terrain, const Eigen::Vector2d& place) {
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j)
      if (!terrain.DepthAt(place.x() + 0.5 * kPairReachM * i, place.y() + 0.5 * kPairReachM * j))
        return false;
  return true;
}

bool Covers(const SyntheticSubmap& submap, const SyntheticPairParams& params, double x, double y) {
  const Eigen::Vector2d p = Inverse(submap.T_map_middle) * Eigen::Vector2d(x, y);
  return std::abs(p.x()) <= 0.5 * params.length_m && std::abs(p.y()) <= 0.5 * params.width_m;
}

// Calls visit(x, y) [map] on a grid over the overlap.
template <class Visit>
void ForEachOverlapCell(const SyntheticPair& pair,
                        const SyntheticPairParams& params,
                        double cell_m,
                        Visit visit) {
  for (double u = 0.5 * (cell_m - params.length_m); u < 0.5 * params.length_m; u += cell_m) {
    for (double v = 0.5 * (cell_m - params.width_m); v < 0.5 * params.width_m; v += cell_m) {
      const Eigen::Vector2d p = pair.target.T_map_middle * Eigen::Vector2d(u, v);
      if (Covers(pair.source, params, p.x(), p.y())) visit(p.x(), p.y());
    }
  }
}

// Inverse covariance of x, y, yaw of T_target_source.
Eigen::Matrix3d FisherInformation(const Site& site,
                                  const SyntheticPair& pair,
                                  const SyntheticPairParams& params) {
  const double density = params.points / (params.length_m * params.width_m);
  const double spacing = 1.0 / std::sqrt(density);
  const double cell = 0.5;
  const double variance = params.sounding_sigma_m * params.sounding_sigma_m;
  const double weight = cell * cell * density / (2.0 * variance);  // of two submaps alike
  const Eigen::Matrix2d to_target = LevelPose(pair.target.T_map_submap).Rotation().transpose();
  const Eigen::Vector2d origin = LevelPose(pair.source.T_map_submap).Translation();
  Eigen::Matrix4d F = Eigen::Matrix4d::Zero();
  ForEachOverlapCell(pair, params, cell, [&](double x, double y) {
    const auto north = site.HeightAt(x + spacing, y);
    const auto south = site.HeightAt(x - spacing, y);
    const auto east = site.HeightAt(x, y + spacing);
    const auto west = site.HeightAt(x, y - spacing);
    if (!north || !south || !east || !west) return;
    const Eigen::Vector2d slope =
        to_target * Eigen::Vector2d(*north - *south, *east - *west) / (2.0 * spacing);
    const Eigen::Vector2d arm = to_target * (Eigen::Vector2d(x, y) - origin);
    const Eigen::Vector4d J(-slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x(), 1.0);
    F += weight * J * J.transpose();
  });
  F(3, 3) += 1.0 / (kHeightSigmaM * kHeightSigmaM);
  return F.topLeftCorner<3, 3>() - F.topRightCorner<3, 1>() * F.bottomLeftCorner<1, 3>() / F(3, 3);
}

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

std::vector<SeabedClass> ProceduralClasses() {
  const auto fractal = [](double rms_m) {
    bench::ProceduralParams params;
    params.depth_m = kDepthM;
    params.relief.rms_m = rms_m;
    return params;
  };
  bench::ProceduralParams waves = fractal(0.05);
  waves.sand_waves.height_m = 0.5;
  waves.sand_waves.heading_deg = 30.0;
  bench::ProceduralParams pipeline = fractal(0.02);
  pipeline.pipeline.diameter_m = 0.5;
  pipeline.pipeline.heading_deg = 60.0;
  return {Procedural("flat", fractal(0.0)),
          Procedural("gentle", fractal(0.15)),
          Procedural("medium", fractal(0.4)),
          Procedural("rough", fractal(1.0)),
          Procedural("sand waves", waves),
          Procedural("pipeline", pipeline)};
}

SeabedClass RasterClass(const std::string& file) {
  bench::RasterParams params;
  params.file = file;
  const std::shared_ptr<const bench::Terrain> terrain = bench::LoadRaster(params, {});
  const std::string name = file.substr(file.find_last_of('/') + 1);
  return {name, [terrain, file](std::uint64_t seed) {
            std::mt19937_64 random(seed);
            std::uniform_real_distribution<double> reach(-kRasterReachM, kRasterReachM);
            for (int attempt = 0; attempt < 100'000; ++attempt) {
              const Eigen::Vector2d place(reach(random), reach(random));
              if (IsKnownAround(*terrain, place)) return Site{terrain, place};
            }
            throw std::runtime_error(file + ": no place for a pair of submaps");
          }};
}

Eigen::Matrix3d PriorCovariance(const Trial& trial) {
  const double sigma = std::max(0.5, 0.5 * trial.offset_m);
  const double sigma_yaw = std::max(Deg2Rad(0.5), 0.5 * trial.yaw_rad);
  return Eigen::Vector3d(sigma * sigma, sigma * sigma, sigma_yaw * sigma_yaw).asDiagonal();
}

SyntheticPair MakeTrialPair(const Site& site, const Trial& trial, std::uint64_t seed) {
  SyntheticPairParams params = trial.pair;
  params.place = site.place;
  return MakePair(site, params, seed);
}

Pose2 MakeTrialPrior(const SyntheticPair& pair, const Trial& trial, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  const double direction = angle(random);
  Pose2 prior = pair.T_target_source;
  prior.x += trial.offset_m * std::cos(direction);
  prior.y += trial.offset_m * std::sin(direction);
  prior.yaw += angle(random) < 0.0 ? -trial.yaw_rad : trial.yaw_rad;
  return prior;
}

Eigen::Vector3d PoseError(const Pose2& estimate, const Pose2& truth) {
  Eigen::Vector3d e = estimate.Vector() - truth.Vector();
  e[2] = WrapAngle(e[2]);
  return e;
}

bool Tolerance::Holds(const Eigen::Vector3d& error) const {
  return error.head<2>().norm() <= position_m && std::abs(error[2]) <= yaw_rad;
}

Outcome RunTrial(const SyntheticPair& pair,
                 const Pose2& T_prior,
                 const Eigen::Matrix3d& prior_covariance,
                 const RegistrationParams& params) {
  const auto prepare = [&](const SyntheticSubmap& submap) {
    return RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params);
  };
  Outcome out;
  const double start = CpuSeconds();
  out.result = Register(prepare(pair.target),
                        prepare(pair.source),
                        T_prior,
                        prior_covariance,
                        pair.z_prior_m,
                        kHeightSigmaM,
                        params);
  out.cpu_s = CpuSeconds() - start;
  out.error = PoseError(out.result.T_target_source, pair.T_target_source);
  return out;
}

double ReliefOf(const Site& site, const SyntheticPair& pair, const SyntheticPairParams& params) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0.0;
  const Eigen::Vector2d middle = pair.target.T_map_middle.Translation();
  ForEachOverlapCell(pair, params, 1.0, [&](double x, double y) {
    const auto height = site.HeightAt(x, y);
    if (!height) return;
    const double z = *height - kDepthM;
    const Eigen::Vector3d row(1.0, x - middle.x(), y - middle.y());
    A += row * row.transpose();
    b += z * row;
    squares += z * z;
  });
  if (!(A(0, 0) > 3.0)) return 0.0;
  return std::sqrt(std::max(0.0, (squares - b.dot(A.ldlt().solve(b))) / A(0, 0)));
}

double CramerRaoRate(const Site& site,
                     const SyntheticPair& pair,
                     const SyntheticPairParams& params,
                     const Tolerance& tolerance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(FisherInformation(site, pair, params));
  const Eigen::Vector3d sigma = eigen.eigenvalues().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 400;
  int within = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector3d unit(normal(random), normal(random), normal(random));
    within += tolerance.Holds(eigen.eigenvectors() * sigma.cwiseProduct(unit));
  }
  return static_cast<double>(within) / kDraws;
}

}  // namespace seastitch
