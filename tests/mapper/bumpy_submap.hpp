#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "common/core/pose.hpp"
#include "common/core/submap.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/level_cloud.hpp"

// Submaps of one synthetic seabed, for tests of registration and loop search.
namespace seastitch {

inline double Bumps(double x, double y) {
  return 20.0 + 0.8 * std::sin(0.35 * x) * std::cos(0.3 * y) + 0.5 * std::sin(0.11 * x + 0.17 * y) +
         0.6 * std::sin(0.21 * x - 0.13 * y + 1.0);
}

// The same with boulders of 2 m in a patch of 12 m, finer than the cells of a registration.
inline double BumpsAndBoulders(double x, double y) {
  const bool in_patch = std::hypot(x - 5.0, y - 4.0) < 6.0;
  return Bumps(x, y) - (in_patch && std::sin(9.0 * x) * std::sin(9.0 * y) > 0.6 ? 2.0 : 0.0);
}

// A swath of 60 x 24 m seen from 10 m above, with its frame believed to be at `believed`.
// height: of the seabed at (x, y) of the map, down, in m.
inline Submap Make(int id,
                   const Pose2& truth,
                   const Pose2& believed,
                   double (*height)(double, double) = Bumps) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.start = submap.frame_time = submap.end = FromUtime(1'000'000 * (id + 1));
  submap.T_map_submap =
      MakePose({believed.x, believed.y, 10.0}, RotationFromRpy(0.0, 0.0, believed.yaw));
  submap.covariance_from_previous = Eigen::Matrix3d(Eigen::Vector3d(0.25, 0.25, 1e-5).asDiagonal());
  std::mt19937_64 random(static_cast<std::uint64_t>(id));
  std::normal_distribution<double> noise(0.0, 0.02);
  std::uniform_real_distribution<double> side(-0.5, 0.5);
  for (int i = 0; i < 15'000; ++i) {
    const Eigen::Vector2d p(60.0 * side(random), 24.0 * side(random));
    const Eigen::Vector2d p_map = truth * p;
    submap.cloud.Add(
        Eigen::Vector3d(p.x(), p.y(), height(p_map.x(), p_map.y()) - 10.0 + noise(random))
            .cast<float>());
  }
  submap.footprint = FootprintOf(LevelCloud(submap.cloud, Eigen::Matrix3d::Identity()));
  submap.predicted_information =
      Eigen::Matrix3d(Eigen::Vector3d(1000.0, 1000.0, 100'000.0).asDiagonal());
  return submap;
}

inline Submap At(int id, double x, double y, double yaw = 0.0) {
  return Make(id, {x, y, yaw}, {x, y, yaw});
}

}  // namespace seastitch
