#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"

// Swaths over a seabed given as a function, without any of the geometry code under test.
namespace seastitch {

using Seabed = std::function<double(double x_m, double y_m)>;  // depth

inline double FlatSeabed(double, double) { return 20.0; }
inline double BumpySeabed(double x, double y) {
  return 20.0 + 0.8 * std::sin(0.35 * x) * std::cos(0.3 * y) + 0.5 * std::sin(0.11 * x + 0.17 * y);
}

// One ping across the track of a vehicle at depth 10 m; beams evenly over +-60 degrees.
struct SwathMaker {
  Seabed seabed = FlatSeabed;
  int beams = 128;
  double sigma_m = 0.02;
  double outlier_part = 0.0;
  std::mt19937_64 random{7};
  std::vector<std::vector<std::uint8_t>> is_outlier;  // by ping, by sounding

  GeoreferencedPing At(Time time, double x_m, double y_m, double yaw_rad) {
    GeoreferencedPing ping;
    ping.time = time;
    ping.T_map_vehicle = MakePose({x_m, y_m, 10.0}, RotationFromRpy(0.0, 0.0, yaw_rad));
    ping.beams_read = beams;
    is_outlier.emplace_back();
    std::normal_distribution<double> noise(0.0, sigma_m);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    std::uniform_real_distribution<double> off(1.0, 5.0);
    for (int b = 0; b < beams; ++b) {
      const double angle = Deg2Rad(-60.0 + 120.0 * b / (beams - 1));
      const double across = 10.0 * std::tan(angle);
      Sounding sounding;
      sounding.beam = b;
      sounding.p_map.x() = x_m - across * std::sin(yaw_rad);
      sounding.p_map.y() = y_m + across * std::cos(yaw_rad);
      sounding.p_map.z() = seabed(sounding.p_map.x(), sounding.p_map.y()) + noise(random);
      const bool outlier = part(random) < outlier_part;
      if (outlier) sounding.p_map.z() += (part(random) < 0.5 ? -1.0 : 1.0) * off(random);
      is_outlier.back().push_back(outlier ? 1 : 0);
      ping.soundings.push_back(sounding);
    }
    return ping;
  }
};

}  // namespace seastitch
