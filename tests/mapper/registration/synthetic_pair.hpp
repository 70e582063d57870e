#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "common/core/pose.hpp"
#include "common/core/submap.hpp"

// Two submaps of a seabed whose truth is known, seen from frames that share nothing: each is
// placed, turned and tilted at random, so that no grid is aligned at the truth.
namespace seastitch {

// A sum of plane waves.
class SyntheticSeabed {
 public:
  static SyntheticSeabed Flat() { return SyntheticSeabed(); }

  // Relief of every direction and of wavelengths between the two, the longer the higher.
  static SyntheticSeabed Fractal(std::uint64_t seed,
                                 double relief_sigma_m,
                                 double min_wavelength_m = 4.0,
                                 double max_wavelength_m = 60.0) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    SyntheticSeabed seabed;
    double variance = 0.0;
    for (int i = 0; i < 60; ++i) {
      const double wavelength =
          min_wavelength_m * std::pow(max_wavelength_m / min_wavelength_m, unit(random));
      const double direction = 2.0 * kPi * unit(random);
      const double k = 2.0 * kPi / wavelength;
      seabed.waves_.push_back(
          {k * std::cos(direction), k * std::sin(direction), 2.0 * kPi * unit(random), wavelength});
      variance += 0.5 * wavelength * wavelength;
    }
    for (Wave& wave : seabed.waves_) wave.amplitude *= relief_sigma_m / std::sqrt(variance);
    return seabed;
  }

  // Crests along one direction only: nothing tells where along them.
  static SyntheticSeabed Ridges(std::uint64_t seed, double relief_sigma_m, double direction_rad) {
    SyntheticSeabed seabed = Fractal(seed, relief_sigma_m);
    for (Wave& wave : seabed.waves_) {
      const double k = std::hypot(wave.kx, wave.ky);
      wave.kx = k * std::cos(direction_rad);
      wave.ky = k * std::sin(direction_rad);
    }
    return seabed;
  }

  // Waves of one length that cross: an egg box, the same again at every crest.
  static SyntheticSeabed EggBox(double wavelength_m, double amplitude_m) {
    SyntheticSeabed seabed;
    const double k = 2.0 * kPi / wavelength_m;
    seabed.waves_ = {{k, 0.0, 0.3, amplitude_m}, {0.0, k, 1.1, amplitude_m}};
    return seabed;
  }

  // The same on a plane that falls by so much a metre to the north and to the east.
  SyntheticSeabed OnASlope(const Eigen::Vector2d& slope) const {
    SyntheticSeabed seabed = *this;
    seabed.slope_ = slope;
    return seabed;
  }

  double HeightAt(double x, double y) const {
    double z = slope_.x() * x + slope_.y() * y;
    for (const Wave& w : waves_) z += w.amplitude * std::sin(w.kx * x + w.ky * y + w.phase);
    return z;
  }

 private:
  struct Wave {
    double kx, ky, phase, amplitude;
  };
  std::vector<Wave> waves_;
  Eigen::Vector2d slope_ = Eigen::Vector2d::Zero();
};

struct SyntheticSubmap {
  PointCloud cloud;  // in the submap frame
  Eigen::Isometry3d T_map_submap;
  Pose2 T_map_middle;  // of the rectangle that the points fill
};

struct SyntheticPair {
  SyntheticSubmap target;
  SyntheticSubmap source;
  Pose2 T_target_source;   // the truth
  double z_prior_m = 0.0;  // as the depth sensor tells it: wrong by the bias
};

struct SyntheticPairParams {
  int points = 5000;  // a submap
  double length_m = 60.0;
  double width_m = 40.0;
  double overlap = 0.4;  // of the width; the two run side by side
  double sounding_sigma_m = 0.05;
  double rim_factor = 1.0;          // of the noise at the long rims, over that in the middle
  double z_bias_m = 0.0;            // the source lies this much deeper than it should
  Eigen::Vector2d place{0.0, 0.0};  // of the pair on the map, to within 10 m
};

// Seabed: HeightAt(x, y) gives the height, positive down, or nothing where none is known.
template <class Seabed>
SyntheticSubmap SampleSubmap(const Seabed& seabed,
                             const Eigen::Isometry3d& T_map_submap,
                             const Pose2& T_map_middle,
                             const SyntheticPairParams& params,
                             std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  std::normal_distribution<double> noise(0.0, params.sounding_sigma_m);
  const auto louder = [&params](double across) {  // across: -0.5 to 0.5
    return 1.0 + (params.rim_factor - 1.0) * 4.0 * across * across;
  };
  SyntheticSubmap out{{}, T_map_submap, T_map_middle};
  const Eigen::Isometry3d T_submap_map = T_map_submap.inverse();
  for (int i = 0; i < params.points; ++i) {
    const double across = unit(*random);
    const double along = unit(*random);
    const Eigen::Vector2d p =
        T_map_middle * Eigen::Vector2d(params.length_m * along, params.width_m * across);
    const std::optional<double> height = seabed.HeightAt(p.x(), p.y());
    if (!height) continue;
    const double z = *height + louder(across) * noise(*random);
    out.cloud.Add((T_submap_map * Eigen::Vector3d(p.x(), p.y(), z)).cast<float>());
  }
  return out;
}

template <class Seabed>
SyntheticPair MakePair(const Seabed& seabed,
                       const SyntheticPairParams& params,
                       std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  const auto frame = [&](const Pose2& middle) {
    // One after the other: compilers evaluate arguments in different orders.
    const double yaw = middle.yaw + 0.3 * unit(random);
    const double pitch = 0.05 * unit(random);
    const Eigen::Matrix3d R = RotationFromRpy(0.05 * unit(random), pitch, yaw);
    return MakePose(
        {middle.x + 5.0 * unit(random), middle.y + 5.0 * unit(random), -10.0 + unit(random)}, R);
  };
  const Pose2 target_middle{params.place.x() + 20.0 * unit(random),
                            params.place.y() + 20.0 * unit(random),
                            2.0 * kPi * unit(random)};
  const Pose2 beside{0.3 * params.length_m * unit(random),
                     params.width_m * (1.0 - params.overlap),
                     0.2 * unit(random) + (unit(random) < 0.0 ? kPi : 0.0)};
  const Pose2 source_middle = target_middle * beside;
  SyntheticPair pair;
  pair.target = SampleSubmap(seabed, frame(target_middle), target_middle, params, &random);
  pair.source = SampleSubmap(seabed, frame(source_middle), source_middle, params, &random);
  pair.T_target_source =
      Inverse(LevelPose(pair.target.T_map_submap)) * LevelPose(pair.source.T_map_submap);
  pair.z_prior_m = pair.source.T_map_submap.translation().z() -
                   pair.target.T_map_submap.translation().z() + params.z_bias_m;
  return pair;
}

// Axes of the target's level frame.
inline Eigen::Vector2d OverlapCenter(const SyntheticPair& pair) {
  const Eigen::Vector2d between =
      0.5 * (pair.target.T_map_middle.Translation() + pair.source.T_map_middle.Translation());
  return Inverse(LevelPose(pair.target.T_map_submap)) * between;
}

}  // namespace seastitch
