#pragma once

#include <array>
#include <cstddef>
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
// Where a ray starts, the speed is the one measured at the sonar's face, in place of the profile's.
// It changes evenly to that of the next sample below: a probe in the water now is better than a
// profile of this morning. Kongsberg's processing unit does the same
// (tests/mapper/geometry/kongsberg_test.cpp).
//
// Above the first and below the last sample the speed is that of the sample: a gradient measured
// over one pair of samples, carried on, may be wrong by metres per second within tens of metres,
// while the deep ocean's own 0.016 /s changes the speed by 1e-4 in 10 m.
class RayTracer {
 public:
  // Nothing where the profile is empty, not finite, not strictly rising in depth, or holds a speed
  // that no sea water has.
  static std::optional<RayTracer> Make(const SoundVelocityProfile& profile);
  // One speed everywhere. Throws std::invalid_argument unless IsSoundSpeed().
  static RayTracer Constant(double speed_mps);

  double SpeedAt(double depth_m) const;

  // Follows a ray that leaves start_depth_m at an angle off the vertical, given as the sine and
  // cosine of the direction (cosine positive: downward), for one_way_s, layer by layer.
  //
  // Nothing where the ray starts upward, turns up before its time is over, or where a number is not
  // finite.
  std::optional<RayEnd> Trace(double start_depth_m,
                              double sin_launch,
                              double cos_launch,
                              double speed_at_transducer_mps,
                              double one_way_s) const;

 private:
  friend class RayFan;
  struct Layer {
    double top_m;
    double bottom_m;
    double speed_top_mps;
    double gradient_per_s;
  };
  explicit RayTracer(std::vector<Layer> layers) : layers_(std::move(layers)) {}
  std::size_t LayerAt(double depth_m) const;
  // The part of a layer below a start in it.
  Layer FirstLayer(std::size_t i, double start_depth_m, double speed_at_transducer_mps) const;

  std::vector<Layer> layers_;  // from -infinity to +infinity, without a hole
};

// The rays of one ping: all from one depth and one speed at the transducer.
//
// Time and distance down to a layer are integrals of a function of sound speed over depth. Expanded
// about the mean speed they become, for every ray, a short sum over the same few moments of the
// profile, so that no ray has to walk through the layers. What is left of a ray in its last layer
// is solved in closed form. Differs from RayTracer::Trace by less than 0.1 mm in 50 m; rays so flat
// that the expansion would not do are handed to it.
class RayFan {
 public:
  // deepest_m: where the rays are expected to end; deeper ones cost more. Keeps a reference to
  // rays. Traces nothing where a number is not finite or the speed is not that of sea water.
  RayFan(const RayTracer& rays,
         double start_depth_m,
         double speed_at_transducer_mps,
         double deepest_m);

  // As RayTracer::Trace. Quickest when neighbouring rays follow one another.
  std::optional<RayEnd> Trace(double sin_launch, double cos_launch, double one_way_s);

 private:
  static constexpr std::size_t kTerms = 7;
  using Series = std::array<double, kTerms>;
  struct Layer {
    double top_m;  // below the start
    double bottom_m;
    double speed_top_mps;
    double gradient_per_s;
    // Integrals over depth of ((c - mean) / mean)^n from the start to the layer's top.
    Series moments;
  };
  void AddMoments();

  const RayTracer& rays_;
  double start_depth_m_;
  double speed_at_transducer_mps_;
  double mean_mps_ = 0.0;
  double spread_ = 0.0;  // of (c - mean) / mean: the largest
  std::vector<Layer> layers_;
  std::size_t last_ = 0;  // layer in which the last ray ended
};

}  // namespace seastitch
