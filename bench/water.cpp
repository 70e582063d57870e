#include "bench/water.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch::bench {
namespace {

// Thickness of a layer [m] with constant sound speed. At a gradient of 1 /s the midpoint rule has a
// relative error of 1e-8 of the path.
constexpr double kLayerM = 0.25;
// Steepest slope of a seabed that is assumed (63 degrees). It limits the step of a ray between two
// checks for a hit.
constexpr double kSteepestSlope = 2.0;
constexpr double kMinStepM = 0.1;
constexpr double kHitToleranceM = 1e-6;
// Cosine from the vertical (87 degrees) below which a ray is given up.
constexpr double kFlattest = 0.05;

}  // namespace

double Water::SpeedAt(double depth_m) const {
  const std::vector<double>& z = params_.depth_m;
  const std::vector<double>& c = params_.speed_mps;
  const auto after = std::upper_bound(z.begin(), z.end(), depth_m);
  if (after == z.begin()) return c.front();
  if (after == z.end()) return c.back();
  const auto i = static_cast<std::size_t>(after - z.begin());
  return c[i - 1] + (c[i] - c[i - 1]) * (depth_m - z[i - 1]) / (z[i] - z[i - 1]);
}

bool Water::Descend(double snell_s_per_m, double by_m, Ray* ray) const {
  const int steps = std::max(1, static_cast<int>(std::ceil(by_m / kLayerM)));
  const double dz = by_m / steps;
  for (int i = 0; i < steps; ++i) {
    const double c = SpeedAt(ray->depth_m + 0.5 * dz);
    const double sine = snell_s_per_m * c;
    const double cosine2 = 1.0 - sine * sine;
    if (!(cosine2 > kFlattest * kFlattest)) return false;
    const double path = dz / std::sqrt(cosine2);
    ray->horizontal_m += sine * path;
    ray->path_m += path;
    ray->time_s += path / c;
    ray->depth_m += dz;
  }
  return true;
}

std::optional<Water::Echo> Water::March(const Terrain& terrain,
                                        const Eigen::Vector3d& p_map,
                                        const Eigen::Vector3d& direction,
                                        double max_range_m) const {
  if (!(direction.z() > kFlattest)) return std::nullopt;
  const double sine = direction.head<2>().norm();
  const double snell = sine / SpeedAt(p_map.z());
  const Eigen::Vector2d ahead =
      sine > 0.0 ? Eigen::Vector2d(direction.head<2>() / sine) : Eigen::Vector2d(1.0, 0.0);
  const auto gap_at = [&](const Ray& ray) -> std::optional<double> {
    const Eigen::Vector2d p = p_map.head<2>() + ray.horizontal_m * ahead;
    const auto depth = terrain.DepthAt(p.x(), p.y());
    if (!depth) return std::nullopt;
    return *depth - ray.depth_m;
  };

  Ray above{0.0, p_map.z(), 0.0, 0.0};
  std::optional<double> gap = gap_at(above);
  if (gap && *gap <= 0.0) return std::nullopt;
  Ray below;
  double depth_gap_below = 0.0;
  for (;;) {
    // Over unknown seabed the smallest step is used.
    const double step =
        std::max(kMinStepM, gap.value_or(0.0) / (direction.z() + kSteepestSlope * sine));
    below = above;
    if (!Descend(snell, step * direction.z(), &below)) return std::nullopt;
    if (below.path_m > max_range_m) return std::nullopt;
    const std::optional<double> gap_below = gap_at(below);
    if (gap_below && *gap_below <= 0.0) {
      if (!gap) return std::nullopt;  // the ray came from an unknown area and is below the seabed
      depth_gap_below = *gap_below;
      break;
    }
    above = below;
    gap = gap_below;
  }

  // Regula falsi (Illinois variant) in depth, between `above` and `below`.
  double low = above.depth_m;
  double high = below.depth_m;
  double gap_low = *gap;
  double gap_high = depth_gap_below;
  Ray hit = below;
  int side = 0;
  for (int i = 0; i < 60 && high - low > kHitToleranceM; ++i) {
    const double depth = (low * gap_high - high * gap_low) / (gap_high - gap_low);
    hit = above;
    if (!Descend(snell, depth - above.depth_m, &hit)) return std::nullopt;
    const std::optional<double> g = gap_at(hit);
    if (!g) return std::nullopt;
    if (std::abs(*g) < kHitToleranceM) break;
    if (*g > 0.0) {
      low = depth;
      gap_low = *g;
      if (side == 1) gap_high *= 0.5;
      side = 1;
    } else {
      high = depth;
      gap_high = *g;
      if (side == -1) gap_low *= 0.5;
      side = -1;
    }
  }
  Echo echo;
  echo.p_map << p_map.head<2>() + hit.horizontal_m * ahead, hit.depth_m;
  echo.one_way_s = hit.time_s;
  echo.snell_s_per_m = snell;
  return echo;
}

std::optional<Water::Passage> Water::Pass(double snell_s_per_m,
                                          double depth_m,
                                          double dz,
                                          int steps) const {
  Passage passage;
  for (int i = 0; i < steps; ++i) {
    const double c = SpeedAt(depth_m + (i + 0.5) * dz);
    const double sine = snell_s_per_m * c;
    const double cosine2 = 1.0 - sine * sine;
    if (!(cosine2 > kFlattest * kFlattest)) return std::nullopt;
    const double path = dz / std::sqrt(cosine2);
    passage.horizontal_m += sine * path;
    passage.slope += c * path / cosine2;
    passage.time_s += path / c;
  }
  return passage;
}

std::optional<Water::Return> Water::Back(const Eigen::Vector3d& p_seabed,
                                         const Eigen::Vector3d& p_receiver,
                                         double snell_guess_s_per_m) const {
  const Eigen::Vector2d way = (p_seabed - p_receiver).head<2>();
  const double distance = way.norm();
  const double down = p_seabed.z() - p_receiver.z();
  if (!(down > 0.0)) return std::nullopt;
  const int steps = std::max(1, static_cast<int>(std::ceil(down / kLayerM)));
  const double dz = down / steps;

  // Newton's method inside a bracket: rays below `low` end before the distance, rays above `high`
  // end beyond it or turn upward.
  double low = 0.0;
  double high = 1.0 / SpeedAt(p_receiver.z());
  double snell = snell_guess_s_per_m;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const std::optional<Passage> passage = Pass(snell, p_receiver.z(), dz, steps);
    const double miss = passage ? distance - passage->horizontal_m : -1.0;
    if (passage && std::abs(miss) < 1e-7) {
      const double sine = snell * SpeedAt(p_receiver.z());
      const Eigen::Vector2d ahead =
          distance > 0.0 ? Eigen::Vector2d(way / distance) : Eigen::Vector2d(1.0, 0.0);
      Return back;
      back.one_way_s = passage->time_s + snell * miss;
      back.towards << sine * ahead, std::sqrt(1.0 - sine * sine);
      return back;
    }
    (miss > 0.0 ? low : high) = snell;
    snell = passage ? snell + miss / passage->slope : high;
    if (!(snell >= low && snell < high)) snell = 0.5 * (low + high);
  }
  return std::nullopt;
}

}  // namespace seastitch::bench
