#pragma once

#include <optional>
#include <vector>

#include "common/core/sensors.hpp"

namespace seastitch {

// Where a ray stands after its one-way time, seen from its start.
struct RayEnd {
  double horizontal_m = 0.0;
  double down_m = 0.0;
};

// Rays through a sound-speed profile, in layers of constant gradient: each piece of a ray is an arc
// of a circle (straight where the gradient vanishes), solved in closed form; see Jensen et al.,
// Computational Ocean Acoustics, 2nd ed., section 3.3.
//
// Above the first and below the last sample the speed is that of the sample: a gradient measured
// over one pair of samples, carried on, may be wrong by metres per second within tens of metres,
// while the deep ocean's own 0.016 /s changes the speed by 1e-4 in 10 m.
class RayTracer {
 public:
  static constexpr double kMinSpeedMps = 1300.0;
  static constexpr double kMaxSpeedMps = 1800.0;

  // Nothing where the profile is empty, not finite, not strictly rising in depth, or holds a speed
  // that no sea water has.
  static std::optional<RayTracer> Make(const SoundVelocityProfile& profile);
  // One speed everywhere. Throws std::invalid_argument outside kMinSpeedMps..kMaxSpeedMps.
  static RayTracer Constant(double speed_mps);

  double SpeedAt(double depth_m) const;

  // Follows a ray that leaves start_depth_m at an angle off the vertical, given as the sine and
  // cosine of the direction (cosine positive: downward), for one_way_s.
  //
  // The array forms its beams with the speed at its own face. Where that differs from the profile's
  // at this depth, the ray is refracted from the one into the other: Snell's constant is
  // sin / speed_at_transducer_mps, and the profile alone gives the speed along the path.
  //
  // Nothing where the ray starts upward, is reflected or turns up before its time is over, or
  // where a number is not finite.
  std::optional<RayEnd> Trace(double start_depth_m,
                              double sin_launch,
                              double cos_launch,
                              double speed_at_transducer_mps,
                              double one_way_s) const;

 private:
  struct Layer {
    double top_m;
    double bottom_m;
    double speed_top_mps;
    double gradient_per_s;
  };
  explicit RayTracer(std::vector<Layer> layers) : layers_(std::move(layers)) {}
  std::size_t LayerAt(double depth_m) const;

  std::vector<Layer> layers_;  // from -infinity to +infinity, without a hole
};

}  // namespace seastitch
