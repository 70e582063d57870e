#include "mapper/geometry/sound_ray.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/core/sensors.hpp"

namespace seastitch {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ln(1 + x) / x and (e^x - 1) / x, continuous at x = 0: with these, arcs become straight lines
// without a separate case. The terms left out of the series are below 1e-16 of the value.
double Log1pOverX(double x) {
  return std::abs(x) < 1e-5 ? 1.0 - x * (0.5 - x / 3.0) : std::log1p(x) / x;
}
constexpr double kSeriesOfExpm1 = 0.01;  // largest x of the series
template <class T>
T Expm1OverXBySeries(const T& x) {
  return 1.0 + x * (1.0 / 2.0 +
                    x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x * (1.0 / 720.0)))));
}
double Expm1OverX(double x) {
  return std::abs(x) > kSeriesOfExpm1 ? std::expm1(x) / x : Expm1OverXBySeries(x);
}

// Horizontal distance of a ray over depth h in a layer with speed c0 + g h. p: Snell's constant;
// cos0, cos1: cosines of the angle from the vertical. It is (cos0 - cos1) / (p g), rewritten
// without the division by g.
template <class T>
T Horizontal(const T& p, double g, const T& h, double c0, const T& cos0, const T& cos1) {
  return p * h * (2.0 * c0 + g * h) / (cos0 + cos1);
}

// Travel time: ln((c1 / c0) (1 + cos0) / (1 + cos1)) / g, rewritten in the same way.
double TravelTime(double p, double g, double h, double c0, double cos0, double cos1) {
  const double speed_part = h / c0;
  const double angle_part = p * p * h * (2.0 * c0 + g * h) / ((cos0 + cos1) * (1.0 + cos1));
  const double k = speed_part + angle_part + g * speed_part * angle_part;
  return k * Log1pOverX(g * k);
}

// End of a ray that travels left_s inside one layer. increase: (e^x - 1) / x at x = g left_s.
// tan(angle / 2) grows as e^(g t); q1 is its square at the end: the ray passes its turning point
// where that is not below 1.
template <class T>
struct EndInLayer {
  T horizontal_m, down_m, q1;
};
template <class T>
EndInLayer<T> WithinLayer(
    const T& p, double g, const T& left_s, double c0, const T& cos0, const T& increase) {
  const T growth = 1.0 + g * left_s * increase;
  const T q0 = (1.0 - cos0) / (1.0 + cos0);
  const T q1 = q0 * growth * growth;
  const T h = c0 * left_s * increase * (1.0 - q0 * growth) / (1.0 + q1);
  const T cos1 = (1.0 - q1) / (1.0 + q1);
  return {Horizontal(p, g, h, c0, cos0, cos1), h, q1};
}

// Nothing if it passes its turning point.
std::optional<RayEnd> WithinLayer(double p, double g, double left_s, double c0, double cos0) {
  const auto end = WithinLayer(p, g, left_s, c0, cos0, Expm1OverX(g * left_s));
  if (!(end.q1 < 1.0)) return std::nullopt;
  return RayEnd{end.horizontal_m, end.down_m};
}

}  // namespace

std::optional<RayTracer> RayTracer::Make(const SoundVelocityProfile& profile) {
  const std::size_t n = profile.depth_m.size();
  if (n == 0 || profile.speed_mps.size() != n) return std::nullopt;
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(profile.depth_m[i]) || !IsSoundSpeed(profile.speed_mps[i]))
      return std::nullopt;
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
  if (!IsSoundSpeed(speed_mps)) throw std::invalid_argument("sound speed is not that of sea water");
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

RayTracer::Layer RayTracer::FirstLayer(std::size_t i,
                                       double start_depth_m,
                                       double speed_at_transducer_mps) const {
  const double bottom_m = layers_[i].bottom_m;
  if (i + 1 == layers_.size()) return {start_depth_m, bottom_m, speed_at_transducer_mps, 0.0};
  const double change_mps = layers_[i + 1].speed_top_mps - speed_at_transducer_mps;
  return {
      start_depth_m, bottom_m, speed_at_transducer_mps, change_mps / (bottom_m - start_depth_m)};
}

std::optional<RayEnd> RayTracer::Trace(double start_depth_m,
                                       double sin_launch,
                                       double cos_launch,
                                       double speed_at_transducer_mps,
                                       double one_way_s) const {
  const bool usable = std::isfinite(start_depth_m) && sin_launch >= 0.0 && sin_launch < 1.0 &&
                      cos_launch > 0.0 && IsSoundSpeed(speed_at_transducer_mps) &&
                      one_way_s >= 0.0 && std::isfinite(one_way_s);
  if (!usable) return std::nullopt;

  const double p = sin_launch / speed_at_transducer_mps;
  std::size_t i = LayerAt(start_depth_m);
  Layer layer = FirstLayer(i, start_depth_m, speed_at_transducer_mps);
  double cos0 = std::sqrt(1.0 - sin_launch * sin_launch);
  double left_s = one_way_s;
  double horizontal = 0.0;
  for (;; layer = layers_[++i]) {
    const double c0 = layer.speed_top_mps;
    const double g = layer.gradient_per_s;
    const double h = layer.bottom_m - layer.top_m;
    const double sin1 = std::isfinite(h) ? p * (c0 + g * h) : 1.0;
    const double cos1 = sin1 < 1.0 ? std::sqrt(1.0 - sin1 * sin1) : 0.0;
    const double layer_s = sin1 < 1.0 ? TravelTime(p, g, h, c0, cos0, cos1) : left_s;
    if (layer_s >= left_s) {
      const auto end = WithinLayer(p, g, left_s, c0, cos0);
      if (!end) return std::nullopt;
      return RayEnd{horizontal + end->horizontal_m, layer.top_m + end->down_m - start_depth_m};
    }
    left_s -= layer_s;
    horizontal += Horizontal(p, g, h, c0, cos0, cos1);
    cos0 = cos1;
  }
}

// --- all rays of a ping ------------------------------------------------------------------------

namespace {

// Largest 2 tan^2(angle) (c - mean) / mean for which the terms left out are below 3e-6 of the
// distance.
constexpr double kMaxExpansion = 0.2;
constexpr double kRounding_m = 1e-6;

// Of one ray (T: double) or of several: see RayFan::Trace().
template <class T, std::size_t kTerms>
struct Expansion {
  // sine: of the angle from the vertical where the speed is the mean.
  explicit Expansion(const T& sine) : sin_mean(sine) {
    using std::sqrt;
    const T cos2_mean = 1.0 - sin_mean * sin_mean;
    tan2 = sin_mean * sin_mean / cos2_mean;
    cos_mean = sqrt(cos2_mean);
    // With c = mean (1 + x): 1 / sqrt(1 - p^2 c^2) = (a0 + a1 x + a2 x^2 + ...) / cos_mean. Time is
    // the integral of this over c, distance that of this times p c.
    T before = 0.0 * sin_mean;
    T a = 1.0 + before;
    for (std::size_t n = 0; n < kTerms; ++n) {
      if (n == 0)
        time[n] = a;
      else
        time[n] = a - time[n - 1];
      distance[n] = a + before;
      const double share = static_cast<double>(n) / static_cast<double>(n + 1);
      const T next = tan2 * (a + share * (a + before));
      before = a;
      a = next;
    }
  }
  T sin_mean, cos_mean, tan2;
  std::array<T, kTerms> time, distance;
};

template <class T, std::size_t kTerms>
T Dot(const std::array<T, kTerms>& a, const std::array<double, kTerms>& b) {
  T sum = a[0] * b[0];
  for (std::size_t n = 1; n < kTerms; ++n) sum += a[n] * b[n];
  return sum;
}

}  // namespace

RayFan::RayFan(const RayTracer& rays,
               double start_depth_m,
               double speed_at_transducer_mps,
               double deepest_m)
    : rays_(rays),
      start_depth_m_(start_depth_m),
      speed_at_transducer_mps_(speed_at_transducer_mps) {
  if (!std::isfinite(start_depth_m) || !IsSoundSpeed(speed_at_transducer_mps)) return;
  std::size_t i = rays.LayerAt(start_depth_m);
  RayTracer::Layer layer = rays.FirstLayer(i, start_depth_m, speed_at_transducer_mps);
  for (;; layer = rays.layers_[++i]) {
    layers_.push_back({layer.top_m - start_depth_m,
                       layer.bottom_m - start_depth_m,
                       layer.speed_top_mps,
                       layer.gradient_per_s,
                       {}});
    if (!(layer.bottom_m < deepest_m) || i + 1 == rays.layers_.size()) break;
  }
  AddMoments();
}

void RayFan::AddMoments() {
  mean_mps_ = layers_.front().speed_top_mps;
  const double whole_m = layers_.back().top_m;
  if (!(whole_m > 0.0)) return;
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < layers_.size(); ++i)
    sum += 0.5 * (layers_[i].speed_top_mps + layers_[i + 1].speed_top_mps) *
           (layers_[i + 1].top_m - layers_[i].top_m);
  mean_mps_ = sum / whole_m;

  const auto deviation = [this](const Layer& layer) {
    return layer.speed_top_mps / mean_mps_ - 1.0;
  };
  spread_ = std::abs(deviation(layers_.front()));
  for (std::size_t i = 1; i < layers_.size(); ++i) {
    const double from = deviation(layers_[i - 1]);
    const double to = deviation(layers_[i]);
    const double h = layers_[i].top_m - layers_[i - 1].top_m;
    spread_ = std::max(spread_, std::abs(to));
    // The mean of x^n over from..to is (to^n + to^(n-1) from + ... + from^n) / (n + 1).
    double sum_of_products = 1.0;
    double power = 1.0;
    for (std::size_t n = 0; n < kTerms; ++n) {
      layers_[i].moments[n] =
          layers_[i - 1].moments[n] + h * sum_of_products / static_cast<double>(n + 1);
      power *= to;
      sum_of_products = power + from * sum_of_products;
    }
  }
}

std::optional<RayEnd> RayFan::Trace(double sin_launch, double cos_launch, double one_way_s) {
  const bool usable = !layers_.empty() && sin_launch >= 0.0 && sin_launch < 1.0 &&
                      cos_launch > 0.0 && one_way_s >= 0.0 && std::isfinite(one_way_s);
  if (!usable) return std::nullopt;
  const auto exactly = [&] {
    return rays_.Trace(start_depth_m_, sin_launch, cos_launch, speed_at_transducer_mps_, one_way_s);
  };
  const double p = sin_launch / speed_at_transducer_mps_;
  const Expansion<double, kTerms> ray(p * mean_mps_);
  if (!(ray.cos_mean > 0.0 && 2.0 * ray.tan2 * spread_ <= kMaxExpansion)) return exactly();
  const double slant_m = one_way_s * mean_mps_ * ray.cos_mean;
  while (last_ > 0 && Dot(ray.time, layers_[last_].moments) > slant_m) --last_;
  while (last_ + 1 < layers_.size() && Dot(ray.time, layers_[last_ + 1].moments) <= slant_m)
    ++last_;

  const Layer& layer = layers_[last_];
  const double left_s = (slant_m - Dot(ray.time, layer.moments)) / (mean_mps_ * ray.cos_mean);
  const double sin0 = p * layer.speed_top_mps;
  const double cos0 = std::sqrt(1.0 - sin0 * sin0);
  const auto end = WithinLayer(p, layer.gradient_per_s, left_s, layer.speed_top_mps, cos0);
  // Positions within rounding of the layer's end count as inside it. Beyond the last layer of the
  // fan the ray is traced exactly.
  if (!end || layer.top_m + end->down_m > layer.bottom_m + kRounding_m) return exactly();
  const double to_layer_m = ray.sin_mean / ray.cos_mean * Dot(ray.distance, layer.moments);
  return RayEnd{to_layer_m + end->horizontal_m, layer.top_m + end->down_m};
}

bool RayFan::TraceInOneLayer(const Launches& rays, Ends* ends) {
  if (layers_.empty()) return false;
  const bool usable = (rays.sin >= 0.0 && rays.sin < 1.0 && rays.cos > 0.0 &&
                       rays.one_way_s >= 0.0 && rays.one_way_s < kInfinity)
                          .all();
  if (!usable) return false;
  const Numbers p = rays.sin / speed_at_transducer_mps_;
  const Expansion<Numbers, kTerms> ray(p * mean_mps_);
  if (!(ray.cos_mean > 0.0 && 2.0 * ray.tan2 * spread_ <= kMaxExpansion).all()) return false;
  const Numbers slant_m = rays.one_way_s * mean_mps_ * ray.cos_mean;
  const Layer& layer = layers_[last_];
  const Numbers to_layer = Dot(ray.time, layer.moments);
  if (last_ > 0 && (to_layer > slant_m).any()) return false;
  if (last_ + 1 < layers_.size() && (Dot(ray.time, layers_[last_ + 1].moments) <= slant_m).any())
    return false;

  const Numbers left_s = (slant_m - to_layer) / (mean_mps_ * ray.cos_mean);
  const Numbers x = layer.gradient_per_s * left_s;
  const Numbers sin0 = p * layer.speed_top_mps;
  const Numbers cos0 = (1.0 - sin0 * sin0).sqrt();
  const auto end = WithinLayer<Numbers>(
      p, layer.gradient_per_s, left_s, layer.speed_top_mps, cos0, Expm1OverXBySeries(x));
  const bool are_inside = (x.abs() <= kSeriesOfExpm1 && end.q1 < 1.0 &&
                           layer.top_m + end.down_m <= layer.bottom_m + kRounding_m)
                              .all();
  if (!are_inside) return false;
  const Numbers to_layer_m = ray.sin_mean / ray.cos_mean * Dot(ray.distance, layer.moments);
  const Numbers horizontal_m = to_layer_m + end.horizontal_m;
  for (std::size_t i = 0; i < kBeside; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    (*ends)[i] = RayEnd{horizontal_m[k], layer.top_m + end.down_m[k]};
  }
  return true;
}

RayFan::Ends RayFan::Trace(const Launches& rays) {
  Ends ends;
  if (TraceInOneLayer(rays, &ends)) return ends;
  for (std::size_t i = 0; i < kBeside; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    ends[i] = Trace(rays.sin[k], rays.cos[k], rays.one_way_s[k]);
  }
  return ends;
}

}  // namespace seastitch
