#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "bench/terrain.hpp"

// Sound in the simulated sea. It shares no line with the mapper's ray tracer, so that no mistake of
// one can hide in the other: rays are marched in small steps, each straight, bent by Snell's law.
namespace seastitch::bench {

struct WaterParams {
  std::vector<double> depth_m{0.0};  // strictly rising; speeds between are linear, beyond constant
  std::vector<double> speed_mps{1500.0};
};

class Water {
 public:
  explicit Water(const WaterParams& params) : params_(params) {}

  double SpeedAt(double depth_m) const;

  struct Echo {
    Eigen::Vector3d p_map;  // where the ray meets the seabed
    double one_way_s = 0.0;
    double snell_s_per_m = 0.0;  // horizontal slowness, constant along the ray
  };
  // Follows a ray from p_map along direction (unit, map axes) to the first seabed it meets. Nothing
  // where there is none within max_range_m of path, where the ray does not go down or turns up,
  // where the seabed is unknown, and where p_map is already in it.
  std::optional<Echo> March(const Terrain& terrain,
                            const Eigen::Vector3d& p_map,
                            const Eigen::Vector3d& direction,
                            double max_range_m) const;

  struct Return {
    double one_way_s = 0.0;
    Eigen::Vector3d towards;  // unit, map axes: from the receiver along the ray that comes in
  };
  // The ray between a point on the seabed and a receiver above it. snell_guess_s_per_m: that of a
  // ray near it. Nothing where no direct ray leads there.
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
  // False where the ray turns up first.
  bool Descend(double snell_s_per_m, double by_m, Ray* ray) const;

  // Through layers of dz downwards.
  struct Passage {
    double horizontal_m = 0.0;
    double time_s = 0.0;
    double slope = 0.0;  // of the horizontal way by the slowness
  };
  std::optional<Passage> Pass(double snell_s_per_m, double depth_m, double dz, int steps) const;

  WaterParams params_;
};

}  // namespace seastitch::bench
