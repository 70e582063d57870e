#include "bench/terrain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bench/random.hpp"
#include "common/core/pose.hpp"

namespace seastitch::bench {
namespace {

constexpr int kDirections = 16;

std::array<Eigen::Vector2d, kDirections> UnitDirections() {
  std::array<Eigen::Vector2d, kDirections> directions;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * kPi * (i + 0.5) / kDirections;
    directions[static_cast<std::size_t>(i)] = {std::cos(angle), std::sin(angle)};
  }
  return directions;
}

double Fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

double LatticeTerm(std::int64_t ix, std::int64_t iy, double x, double y, std::uint64_t seed) {
  static const std::array<Eigen::Vector2d, kDirections> kUnit = UnitDirections();
  const std::uint64_t key = static_cast<std::uint64_t>(ix) * 0x9E3779B97F4A7C15u ^
                            static_cast<std::uint64_t>(iy) * 0xC2B2AE3D27D4EB4Fu ^ seed;
  const Eigen::Vector2d& g = kUnit[MixBits(key) % kDirections];
  return g.x() * x + g.y() * y;
}

// Gradient noise with a lattice spacing of 1.
double GradientNoise(double x, double y, std::uint64_t seed) {
  const double fx = std::floor(x);
  const double fy = std::floor(y);
  const auto ix = static_cast<std::int64_t>(fx);
  const auto iy = static_cast<std::int64_t>(fy);
  const double dx = x - fx;
  const double dy = y - fy;
  const double wx = Fade(dx);
  const double wy = Fade(dy);
  const double n00 = LatticeTerm(ix, iy, dx, dy, seed);
  const double n10 = LatticeTerm(ix + 1, iy, dx - 1.0, dy, seed);
  const double n01 = LatticeTerm(ix, iy + 1, dx, dy - 1.0, seed);
  const double n11 = LatticeTerm(ix + 1, iy + 1, dx - 1.0, dy - 1.0, seed);
  const double n0 = n00 + wx * (n10 - n00);
  const double n1 = n01 + wx * (n11 - n01);
  return n0 + wy * (n1 - n0);
}

// Variance over the plane: each corner adds weight^2 r^2 / 2, for gradients of random direction.
double GradientNoiseVariance() {
  constexpr int kSteps = 1000;
  double weight2 = 0.0;
  double weight2_x2 = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) / kSteps;
    const double w = 1.0 - Fade(x);
    weight2 += w * w / kSteps;
    weight2_x2 += w * w * x * x / kSteps;
  }
  return 4.0 * weight2 * weight2_x2;
}

Eigen::Vector2d Heading(double deg) { return {std::cos(Deg2Rad(deg)), std::sin(Deg2Rad(deg))}; }

double CatmullRom(double a, double b, double c, double d, double t) {
  return b +
         0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)));
}

}  // namespace

ProceduralTerrain::ProceduralTerrain(const ProceduralParams& params, std::uint64_t seed)
    : params_(params),
      wave_direction_(Heading(params.sand_waves.heading_deg)),
      pipe_direction_(Heading(params.pipeline.heading_deg)) {
  Random random(seed, "terrain");
  wave_seed_ = random.Bits();
  const ReliefParams& relief = params.relief;
  if (relief.rms_m <= 0.0) return;
  double variance = 0.0;
  for (double length = relief.longest_m; length >= relief.shortest_m; length *= 0.5) {
    const double angle = 2.0 * kPi * random.Uniform();  // random directions hide the lattice
    const double amplitude = std::pow(length, relief.hurst);
    octaves_.push_back(
        {std::cos(angle) / length, std::sin(angle) / length, amplitude, random.Bits()});
    variance += amplitude * amplitude * GradientNoiseVariance();
  }
  for (Octave& octave : octaves_) octave.amplitude_m *= relief.rms_m / std::sqrt(variance);
}

std::optional<double> ProceduralTerrain::DepthAt(double north_m, double east_m) const {
  const double rough = Roughness(north_m);
  double depth = params_.depth_m + params_.slope_north * north_m + params_.slope_east * east_m;
  if (rough > 0.0) depth -= rough * (Relief(north_m, east_m) + SandWave(north_m, east_m));
  return depth - PipeHeight(north_m, east_m);
}

double ProceduralTerrain::Relief(double north_m, double east_m) const {
  double height = 0.0;
  for (const Octave& o : octaves_) {
    height += o.amplitude_m * GradientNoise(o.cos_per_m * north_m - o.sin_per_m * east_m,
                                            o.sin_per_m * north_m + o.cos_per_m * east_m,
                                            o.seed);
  }
  return height;
}

double ProceduralTerrain::SandWave(double north_m, double east_m) const {
  const SandWaveParams& wave = params_.sand_waves;
  if (wave.height_m <= 0.0) return 0.0;
  const double bend_length = 5.0 * wave.length_m;
  const double bend =
      GradientNoise(north_m / bend_length, east_m / bend_length, wave_seed_) * 1.5 * kPi;
  const double swell =
      GradientNoise(north_m / bend_length, east_m / bend_length, MixBits(wave_seed_));
  const double along = wave_direction_.x() * north_m + wave_direction_.y() * east_m;
  const double phase = 2.0 * kPi * along / wave.length_m + bend;
  // The second harmonic makes the lee side of a ripple steeper.
  const double shape = std::sin(phase) + 0.2 * std::sin(2.0 * phase);
  return 0.5 * wave.height_m * (0.8 + 0.6 * swell) * shape;
}

double ProceduralTerrain::PipeHeight(double north_m, double east_m) const {
  const PipelineParams& pipe = params_.pipeline;
  if (pipe.diameter_m <= 0.0) return 0.0;
  const double off =
      pipe_direction_.x() * (east_m - pipe.east_m) - pipe_direction_.y() * (north_m - pipe.north_m);
  const double radius = 0.5 * pipe.diameter_m;
  if (std::abs(off) >= radius) return 0.0;
  return radius + std::sqrt(radius * radius - off * off);
}

double ProceduralTerrain::Roughness(double north_m) const {
  const FlatStripParams& flat = params_.flat_strip;
  if (flat.to_north_m <= flat.from_north_m) return 1.0;
  constexpr double kEdgeM = 10.0;  // width [m] over which the relief fades out
  const double outside = std::max(flat.from_north_m - north_m, north_m - flat.to_north_m);
  return Fade(std::clamp(outside / kEdgeM, 0.0, 1.0));
}

GridTerrain::GridTerrain(Cells cells, double fill_m, const MapBox& box) : cells_(std::move(cells)) {
  Fill(fill_m);
  Place(box);
}

// Fills unknown cells ring by ring from the known ones, each with the mean of its known neighbours.
// Three more rings are filled for the interpolation only.
void GridTerrain::Fill(double fill_m) {
  constexpr int kInterpolationRings = 3;
  const int rings = static_cast<int>(fill_m / std::max(cells_.cell_north_m, cells_.cell_east_m));
  known_.resize(cells_.depth_m.size());
  for (std::size_t i = 0; i < known_.size(); ++i) known_[i] = std::isfinite(cells_.depth_m[i]);

  for (int ring = 0; ring < rings + kInterpolationRings; ++ring) {
    std::vector<std::pair<std::size_t, float>> filled;
    for (int row = 0; row < cells_.rows; ++row) {
      for (int col = 0; col < cells_.cols; ++col) {
        if (std::isfinite(cells_.depth_m[Index(row, col)])) continue;
        double sum = 0.0;
        int count = 0;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, cells_.rows - 1); ++r) {
          for (int c = std::max(col - 1, 0); c <= std::min(col + 1, cells_.cols - 1); ++c) {
            const float depth = cells_.depth_m[Index(r, c)];
            if (!std::isfinite(depth)) continue;
            sum += double{depth};
            ++count;
          }
        }
        if (count > 0) filled.emplace_back(Index(row, col), static_cast<float>(sum / count));
      }
    }
    for (const auto& [index, depth] : filled) {
      cells_.depth_m[index] = depth;
      if (ring < rings) known_[index] = 1;
    }
  }
}

void GridTerrain::Place(const MapBox& box) {
  // sums(r, c): number of known cells south-west of (r, c).
  const auto at = [this](int row, int col) {
    return static_cast<std::size_t>(row) * (static_cast<std::size_t>(cells_.cols) + 1) +
           static_cast<std::size_t>(col);
  };
  std::vector<std::int64_t> sums(at(cells_.rows, cells_.cols) + 1, 0);
  for (int r = 0; r < cells_.rows; ++r)
    for (int c = 0; c < cells_.cols; ++c)
      sums[at(r + 1, c + 1)] =
          sums[at(r, c + 1)] + sums[at(r + 1, c)] - sums[at(r, c)] + known_[Index(r, c)];

  const Eigen::Vector2d size = box.max - box.min;
  const int rows = std::min(cells_.rows, static_cast<int>(size.x() / cells_.cell_north_m) + 1);
  const int cols = std::min(cells_.cols, static_cast<int>(size.y() / cells_.cell_east_m) + 1);
  std::int64_t best_known = -1;
  double best_off = 0.0;
  int best_row = 0;
  int best_col = 0;
  for (int r = 0; r + rows <= cells_.rows; ++r) {
    for (int c = 0; c + cols <= cells_.cols; ++c) {
      const std::int64_t known = sums[at(r + rows, c + cols)] - sums[at(r, c + cols)] -
                                 sums[at(r + rows, c)] + sums[at(r, c)];
      const double off =
          std::hypot(r + 0.5 * rows - 0.5 * cells_.rows, c + 0.5 * cols - 0.5 * cells_.cols);
      if (known < best_known || (known == best_known && off >= best_off)) continue;
      best_known = known;
      best_off = off;
      best_row = r;
      best_col = c;
    }
  }
  // Puts the middle of the box on the middle of the window.
  const Eigen::Vector2d window_middle((best_row + 0.5 * rows) * cells_.cell_north_m,
                                      (best_col + 0.5 * cols) * cells_.cell_east_m);
  corner_ = 0.5 * (box.min + box.max) - window_middle;
}

std::optional<double> GridTerrain::DepthAt(double north_m, double east_m) const {
  // Depths belong to the centres of the cells.
  const double x = (north_m - corner_.x()) / cells_.cell_north_m - 0.5;
  const double y = (east_m - corner_.y()) / cells_.cell_east_m - 0.5;
  if (!(x >= -0.5 && x <= cells_.rows - 0.5 && y >= -0.5 && y <= cells_.cols - 0.5))
    return std::nullopt;
  const int nearest_row = std::clamp(static_cast<int>(std::lround(x)), 0, cells_.rows - 1);
  const int nearest_col = std::clamp(static_cast<int>(std::lround(y)), 0, cells_.cols - 1);
  if (known_[Index(nearest_row, nearest_col)] == 0) return std::nullopt;

  const int row = static_cast<int>(std::floor(x));
  const int col = static_cast<int>(std::floor(y));
  std::array<double, 4> across;
  for (int i = 0; i < 4; ++i) {
    const int r = std::clamp(row - 1 + i, 0, cells_.rows - 1);
    std::array<double, 4> v;
    for (int j = 0; j < 4; ++j) {
      const int c = std::clamp(col - 1 + j, 0, cells_.cols - 1);
      v[static_cast<std::size_t>(j)] = double{cells_.depth_m[Index(r, c)]};
    }
    across[static_cast<std::size_t>(i)] = CatmullRom(v[0], v[1], v[2], v[3], y - col);
  }
  const double depth = CatmullRom(across[0], across[1], across[2], across[3], x - row);
  if (!std::isfinite(depth)) return std::nullopt;
  return depth;
}

}  // namespace seastitch::bench
