#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "bench/terrain.hpp"

// Sound in the simulated sea. It shares no code with the mapper's ray tracer, so that an error in
// one cannot cancel in the other. Rays are followed in small straight steps, refracted by Snell's
// law.
namespace seastitch::bench {

struct WaterParams {
  // strictly increasing; the speed is linear between them and constant beyond
  std::vector<double> depth_m{0.0};
  std::vector<double> speed_mps{1500.0};
};

class Water {
 public:
  explicit Water(const WaterParams& params) : params_(params) {}

  double SpeedAt(double depth_m) const;

  struct Echo {
    Eigen::Vector3d p_map;  // intersection of the ray with the seabed
    double one_way_s = 0.0;
    double snell_s_per_m = 0.0;  // horizontal slowness, constant along the ray
  };
  // Follows a ray from p_map along direction (unit vector, map axes) to the first intersection with
  // the seabed. Nothing if there is none within max_range_m of path, if the ray does not go down or
  // turns upward, if the seabed is unknown, or if p_map is below it.
  std::optional<Echo> March(const Terrain& terrain,
                            const Eigen::Vector3d& p_map,
                            const Eigen::Vector3d& direction,
                            double max_range_m) const;

  struct Return {
    double one_way_s = 0.0;
    Eigen::Vector3d towards;  // unit, map axes: from the receiver along the ray that comes in
  };
  // The direct ray between a point on the seabed and a receiver above it. snell_guess_s_per_m: that
  // of a similar ray. Nothing if there is no such ray.
  std::optional<Return> Back(const Eigen::Vector3d& p_seabed,
                             const Eigen::Vector3d& p_receiver,
                             double snell_guess_s_per_m) const;

 private:
  struct Ray {
    double horizontal_m = 0.0;
    double depth_m = 0.0;
    double path_m = 0.0;
    double time_s = 0.0;
  };
  // False if the ray turns upward before.
  bool Descend(double snell_s_per_m, double by_m, Ray* ray) const;

  // Through layers of dz downwards.
  struct Passage {
    double horizontal_m = 0.0;
    double time_s = 0.0;
    double slope = 0.0;  // derivative of the horizontal distance by the slowness
  };
  std::optional<Passage> Pass(double snell_s_per_m, double depth_m, double dz, int steps) const;

  WaterParams params_;
};

}  // namespace seastitch::bench
