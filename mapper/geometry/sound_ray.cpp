#include "mapper/geometry/sound_ray.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace seastitch {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool IsSpeed(double mps) {
  return mps >= RayTracer::kMinSpeedMps && mps <= RayTracer::kMaxSpeedMps;
}

// ln(1 + x) / x and (e^x - 1) / x, whole at x = 0: with these the arcs become straight lines
// without a case of their own. The series end below 1e-16 of the value.
double Log1pOverX(double x) {
  return std::abs(x) < 1e-5 ? 1.0 - x * (0.5 - x / 3.0) : std::log1p(x) / x;
}
double Expm1OverX(double x) {
  return std::abs(x) < 1e-5 ? 1.0 + x * (0.5 + x / 6.0) : std::expm1(x) / x;
}

// Depth h further down in a layer of speed c0 + g h, for a ray of Snell's constant p whose cosines
// off the vertical are cos0 and cos1. From x = (cos0 - cos1) / (p g), free of the division by g.
double Horizontal(double p, double g, double h, double c0, double cos0, double cos1) {
  return p * h * (2.0 * c0 + g * h) / (cos0 + cos1);
}

// From t = ln((c1 / c0) (1 + cos0) / (1 + cos1)) / g, the same way.
double TravelTime(double p, double g, double h, double c0, double cos0, double cos1) {
  const double speed_part = h / c0;
  const double angle_part = p * p * h * (2.0 * c0 + g * h) / ((cos0 + cos1) * (1.0 + cos1));
  const double k = speed_part + angle_part + g * speed_part * angle_part;
  return k * Log1pOverX(g * k);
}

}  // namespace

std::optional<RayTracer> RayTracer::Make(const SoundVelocityProfile& profile) {
  const std::size_t n = profile.depth_m.size();
  if (n == 0 || profile.speed_mps.size() != n) return std::nullopt;
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(profile.depth_m[i]) || !IsSpeed(profile.speed_mps[i])) return std::nullopt;
    if (i > 0 && !(profile.depth_m[i] > profile.depth_m[i - 1])) return std::nullopt;
  }
  std::vector<Layer> layers;
  layers.reserve(n + 1);
  layers.push_back({-kInfinity, profile.depth_m.front(), profile.speed_mps.front(), 0.0});
  for (std::size_t i = 1; i < n; ++i) {
    const double gradient = (profile.speed_mps[i] - profile.speed_mps[i - 1]) /
                            (profile.depth_m[i] - profile.depth_m[i - 1]);
    layers.push_back(
        {profile.depth_m[i - 1], profile.depth_m[i], profile.speed_mps[i - 1], gradient});
  }
  layers.push_back({profile.depth_m.back(), kInfinity, profile.speed_mps.back(), 0.0});
  return RayTracer(std::move(layers));
}

RayTracer RayTracer::Constant(double speed_mps) {
  if (!IsSpeed(speed_mps)) throw std::invalid_argument("sound speed is not that of sea water");
  return RayTracer({{-kInfinity, kInfinity, speed_mps, 0.0}});
}

std::size_t RayTracer::LayerAt(double depth_m) const {
  const auto above = [](double depth, const Layer& layer) { return depth < layer.top_m; };
  const auto next = std::upper_bound(layers_.begin() + 1, layers_.end(), depth_m, above);
  return static_cast<std::size_t>(next - layers_.begin()) - 1;
}

double RayTracer::SpeedAt(double depth_m) const {
  const Layer& layer = layers_[LayerAt(depth_m)];
  if (layer.gradient_per_s == 0.0) return layer.speed_top_mps;
  return layer.speed_top_mps + layer.gradient_per_s * (depth_m - layer.top_m);
}

std::optional<RayEnd> RayTracer::Trace(double start_depth_m,
                                       double sin_launch,
                                       double cos_launch,
                                       double speed_at_transducer_mps,
                                       double one_way_s) const {
  const bool usable = std::isfinite(start_depth_m) && sin_launch >= 0.0 && sin_launch < 1.0 &&
                      cos_launch > 0.0 && IsSpeed(speed_at_transducer_mps) && one_way_s >= 0.0 &&
                      std::isfinite(one_way_s);
  if (!usable) return std::nullopt;

  const double p = sin_launch / speed_at_transducer_mps;
  double depth = start_depth_m;
  double c0 = SpeedAt(depth);
  if (!(p * c0 < 1.0)) return std::nullopt;
  double cos0 = std::sqrt(1.0 - p * p * c0 * c0);
  double left_s = one_way_s;
  double horizontal = 0.0;
  for (std::size_t i = LayerAt(depth); i < layers_.size(); ++i) {
    const double g = layers_[i].gradient_per_s;
    const double h = layers_[i].bottom_m - depth;
    const double sin1 = p * (c0 + g * h);
    if (std::isfinite(h) && sin1 < 1.0) {
      const double cos1 = std::sqrt(1.0 - sin1 * sin1);
      const double layer_s = TravelTime(p, g, h, c0, cos0, cos1);
      if (layer_s < left_s) {
        left_s -= layer_s;
        horizontal += Horizontal(p, g, h, c0, cos0, cos1);
        depth = layers_[i].bottom_m;
        c0 += g * h;
        cos0 = cos1;
        continue;
      }
    }
    // It ends here. tan(angle / 2) grows as e^(g t); q is its square.
    const double growth = std::exp(g * left_s);
    const double q0 = (1.0 - cos0) / (1.0 + cos0);
    const double q1 = q0 * growth * growth;
    if (!(q1 < 1.0)) return std::nullopt;  // past the turning point
    const double end_h = c0 * left_s * Expm1OverX(g * left_s) * (1.0 - q0 * growth) / (1.0 + q1);
    const double cos1 = (1.0 - q1) / (1.0 + q1);
    horizontal += Horizontal(p, g, end_h, c0, cos0, cos1);
    return RayEnd{horizontal, depth + end_h - start_depth_m};
  }
  return std::nullopt;
}

}  // namespace seastitch
