#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/core/sensors.hpp"

namespace seastitch {

// End of a ray after its one-way travel time, relative to its start.
struct RayEnd {
  double horizontal_m = 0.0;  // distance in the vertical plane of the ray, not negative
  double down_m = 0.0;        // positive down
};

// Rays through a sound-speed profile, in layers of constant gradient: each piece of a ray is an arc
// of a circle (straight where the gradient vanishes), solved in closed form; see Jensen et al.,
// Computational Ocean Acoustics, 2nd ed., section 3.3.
//
// At the start of a ray the speed is the one measured at the transducer's face, in place of the
// profile's, since the probe is newer than the profile. From there it changes linearly with depth
// to that of the next profile sample below. Kongsberg's processing unit does the same
// (tests/mapper/geometry/kongsberg_test.cpp).
//
// Above the first and below the last sample the speed is that of the nearest sample. An
// extrapolated gradient of one pair of samples may be wrong by metres per second within tens of
// metres, while the deep ocean's gradient of 0.016 /s changes the speed by 0.16 m/s (1e-4) in 10 m.
class RayTracer {
 public:
  // Depths of the profile are below the water line. std::nullopt where it is empty, not finite, not
  // strictly increasing in depth, or has a speed outside of 1300 to 1800 m/s (IsSoundSpeed()).
  static std::optional<RayTracer> Make(const SoundVelocityProfile& profile);
  // One speed everywhere. Throws std::invalid_argument unless IsSoundSpeed().
  static RayTracer Constant(double speed_mps);

  // Speed of the profile [m/s] at a depth below the water line.
  double SpeedAt(double depth_m) const;

  // Follows a ray from start_depth_m (below the water line) for one_way_s, layer by layer.
  // sin_launch (not negative), cos_launch (positive downward): sine and cosine of the angle from
  // the vertical. The caller knows the azimuth.
  //
  // std::nullopt where the ray starts horizontally or upward (cosine not above 0), turns upward
  // before its time is over, or where a number is not finite.
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
// profile, so that no ray has to walk through the layers. The rest of a ray in its last layer is
// solved in closed form. The result differs from RayTracer::Trace by less than 0.1 mm in 50 m. Rays
// too flat for the expansion are traced by RayTracer::Trace.
class RayFan {
 public:
  // deepest_m: depth below the water line at which the rays are expected to end; a deeper ray is
  // traced more slowly. Keeps a reference to rays. Trace() returns std::nullopt where a number is
  // not finite or the speed is not that of sea water.
  RayFan(const RayTracer& rays,
         double start_depth_m,
         double speed_at_transducer_mps,
         double deepest_m);

  // As RayTracer::Trace. Fastest for rays in the order of their angle.
  std::optional<RayEnd> Trace(double sin_launch, double cos_launch, double one_way_s);
  // Several beside each other: faster where all of them end in one layer.
  static constexpr std::size_t kBeside = 4;
  using Numbers = Eigen::Array<double, static_cast<int>(kBeside), 1>;
  struct Launches {
    Numbers sin, cos, one_way_s;
  };
  using Ends = std::array<std::optional<RayEnd>, kBeside>;
  Ends Trace(const Launches& rays);

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
  // False where they do not all end in the layer in which the last ray ended.
  bool TraceInOneLayer(const Launches& rays, Ends* ends);

  const RayTracer& rays_;
  double start_depth_m_;
  double speed_at_transducer_mps_;
  double mean_mps_ = 0.0;
  double spread_ = 0.0;  // largest magnitude of (c - mean) / mean
  std::vector<Layer> layers_;
  std::size_t last_ = 0;  // layer in which the last ray ended
};

}  // namespace seastitch
