#include "tests/perf/registration_trial.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <stdexcept>
#include <utility>

#include "bench/terrain_raster.hpp"
#include "mapper/registration/correlator.hpp"

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

// The waves of a square of seabed.
class SeabedWaves {
 public:
  explicit SeabedWaves(const SyntheticPairParams& params)
      : spacing_m_(std::sqrt(params.length_m * params.width_m / params.points)),
        cell_m_(0.5 * spacing_m_),
        correlator_(static_cast<int>(2.0 * kPairReachM / cell_m_),
                    static_cast<int>(2.0 * kPairReachM / cell_m_)),
        power_(static_cast<std::size_t>(correlator_.rows())) {}

  double cell_m() const { return cell_m_; }
  int size() const { return correlator_.rows(); }
  Eigen::Vector2d Center(const Site& site, int row, int col) const {
    return site.place + cell_m_ * Eigen::Vector2d(row - size() / 2, col - size() / 2);
  }

  // A piece of seabed whose waves count in the mean power of their lengths.
  void Learn(const Site& site) {
    std::vector<double> image = Heights(site);
    double window_square = 0.0;
    for (int row = 0; row < size(); ++row) {
      for (int col = 0; col < size(); ++col) {
        const double window = Hann(row) * Hann(col);
        image[Index(row, col)] *= window;
        window_square += window * window;
      }
    }
    const Correlator::Spectrum waves = correlator_.Transform(image);
    const double scale = cell_m_ * cell_m_ / window_square;
    ForEachWave([&](std::size_t i, const Eigen::Vector2d& k) {
      Mean& power = power_[LengthOf(k)];
      power.sum += scale * std::norm(waves[i]);
      power.count += 1.0;
    });
  }

  // Slopes of a seabed along north and east, cell by cell, the waves weighed by what two surveys
  // of which each has a noise of that power say of them. See FisherInformation().
  std::vector<Eigen::Vector2d> WeighedSlopes(const Site& site, double noise_power) {
    const Correlator::Spectrum waves = correlator_.Transform(Heights(site));
    std::vector<Eigen::Vector2d> slopes(Index(size(), 0));
    for (int axis = 0; axis < 2; ++axis) {
      Correlator::Spectrum derivative(waves.size(), 0.0);
      ForEachWave([&](std::size_t i, const Eigen::Vector2d& k) {
        if (k.norm() > kPi / spacing_m_) return;
        const Mean& mean = power_[LengthOf(k)];
        const double power = mean.sum / mean.count;
        // The correlator takes the conjugate.
        derivative[i] = {0.0, -k[axis] * std::sqrt(power / (power + 0.5 * noise_power))};
      });
      const double* values = correlator_.Correlate(derivative, waves);
      for (std::size_t i = 0; i < slopes.size(); ++i) slopes[i][axis] = values[i];
    }
    return slopes;
  }

 private:
  struct Mean {
    double sum = 0.0;
    double count = 0.0;
  };

  std::size_t Index(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(size()) +
           static_cast<std::size_t>(col);
  }
  double Hann(int i) const { return 0.5 - 0.5 * std::cos(2.0 * kPi * (i + 0.5) / size()); }
  std::size_t LengthOf(const Eigen::Vector2d& k) const {
    const auto n = static_cast<std::size_t>(std::lround(k.norm() * size() * cell_m_ / (2.0 * kPi)));
    return std::min(n, power_.size() - 1);
  }

  // Calls visit(index, wave number [rad/m]) for the waves of a transform.
  template <class Visit>
  void ForEachWave(Visit visit) const {
    const double step = 2.0 * kPi / (size() * cell_m_);
    std::size_t i = 0;
    for (int row = 0; row < size(); ++row)
      for (int col = 0; col <= size() / 2; ++col, ++i)
        visit(i, step * Eigen::Vector2d(row < size() / 2 ? row : row - size(), col));
  }

  // Heights about their mean, 0 where unknown. Where steps are, the mean over the cell: a pipe that
  // is sampled at the centres of cells alone shows slopes along itself.
  std::vector<double> Heights(const Site& site) const {
    constexpr double kStepM = 0.1;
    std::vector<double> centers(Index(size(), 0));
    for (int row = 0; row < size(); ++row)
      for (int col = 0; col < size(); ++col)
        centers[Index(row, col)] = MeanHeight(site, row, col, 1);
    std::vector<double> heights = centers;
    Mean all;
    for (int row = 0; row < size(); ++row) {
      for (int col = 0; col < size(); ++col) {
        const double center = centers[Index(row, col)];
        const auto is_step = [&](int r, int c) {
          return std::abs(centers[Index(Inside(r), Inside(c))] - center) > kStepM;
        };
        double& height = heights[Index(row, col)];
        if (is_step(row - 1, col) || is_step(row + 1, col) || is_step(row, col - 1) ||
            is_step(row, col + 1))
          height = MeanHeight(site, row, col, 16);
        if (std::isnan(height)) continue;
        all.sum += height;
        all.count += 1.0;
      }
    }
    for (double& height : heights) height = std::isnan(height) ? 0.0 : height - all.sum / all.count;
    return heights;
  }

  int Inside(int i) const { return std::clamp(i, 0, size() - 1); }

  // Of a cell, over samples x samples places; NaN where all are unknown.
  double MeanHeight(const Site& site, int row, int col, int samples) const {
    Mean mean;
    for (int i = 0; i < samples * samples; ++i) {
      const Eigen::Array2d part(i / samples, i % samples);
      const Eigen::Vector2d p =
          Center(site, row, col) + cell_m_ * ((part + 0.5) / samples - 0.5).matrix();
      const auto height = site.HeightAt(p.x(), p.y());
      if (!height) continue;
      mean.sum += *height;
      mean.count += 1.0;
    }
    return mean.sum / mean.count;
  }

  double spacing_m_;  // of soundings
  double cell_m_;
  Correlator correlator_;
  std::vector<Mean> power_;  // by wave number, in steps of one wave a side
};

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

TrialOutcome RunTrial(const SyntheticPair& pair,
                      const Pose2& T_prior,
                      const Eigen::Matrix3d& prior_covariance,
                      const RegistrationParams& params) {
  const auto prepare = [&](const SyntheticSubmap& submap) {
    return RegistrationSubmap::Prepare(submap.cloud, LevelFromBody(submap.T_map_submap), params);
  };
  TrialOutcome out;
  const double start = CpuSeconds();
  out.result = Align(prepare(pair.target),
                     prepare(pair.source),
                     {T_prior, prior_covariance, pair.z_prior_m, kHeightSigmaM},
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

std::vector<Eigen::Matrix3d> FisherInformation(const std::vector<Site>& sites,
                                               const std::vector<SyntheticPair>& pairs,
                                               const SyntheticPairParams& params) {
  SeabedWaves waves(params);
  for (const Site& site : sites) waves.Learn(site);
  const double area = params.length_m * params.width_m / params.points;  // of a sounding
  const double noise_power = params.sounding_sigma_m * params.sounding_sigma_m * area;
  const double weight = waves.cell_m() * waves.cell_m() / (2.0 * noise_power);  // of two alike
  std::vector<Eigen::Matrix3d> out;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::vector<Eigen::Vector2d> slopes = waves.WeighedSlopes(sites[i], noise_power);
    const Eigen::Matrix2d to_target =
        LevelPose(pairs[i].target.T_map_submap).Rotation().transpose();
    const Eigen::Vector2d origin = LevelPose(pairs[i].source.T_map_submap).Translation();
    Eigen::Matrix4d F = Eigen::Matrix4d::Zero();
    std::size_t cell = 0;
    for (int row = 0; row < waves.size(); ++row) {
      for (int col = 0; col < waves.size(); ++col, ++cell) {
        const Eigen::Vector2d p = waves.Center(sites[i], row, col);
        if (!Covers(pairs[i].target, params, p.x(), p.y()) ||
            !Covers(pairs[i].source, params, p.x(), p.y()))
          continue;
        const Eigen::Vector2d slope = to_target * slopes[cell];
        const Eigen::Vector2d arm = to_target * (p - origin);
        const Eigen::Vector4d J(
            -slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x(), 1.0);
        F += weight * J * J.transpose();
      }
    }
    F(3, 3) += 1.0 / (kHeightSigmaM * kHeightSigmaM);
    out.emplace_back(F.topLeftCorner<3, 3>() -
                     F.topRightCorner<3, 1>() * F.bottomLeftCorner<1, 3>() / F(3, 3));
  }
  return out;
}

double CramerRaoRate(const Eigen::Matrix3d& information, const Tolerance& tolerance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
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
