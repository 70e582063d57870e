#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "common/core/calibration.hpp"
#include "common/core/placed_soundings.hpp"
#include "common/core/pose.hpp"
#include "mapper/calibration/calibration_cells.hpp"

// Soundings of a survey whose sonar has an error, made by a geometry of their own.
namespace seastitch::test {

inline const Time kStart = FromUtime(1'700'000'000'000'000);
inline constexpr double kSpeedMps = 1.5;
inline constexpr double kLineM = 120.0;
inline constexpr double kSubmapM = 40.0;
inline constexpr double kPingS = 0.2;
inline constexpr int kBeams = 64;
// A sonar that looks 10 degrees to starboard.
inline const Eigen::Isometry3d kSonar =
    MakePose({0.4, 0.1, 0.2}, RotationFromRpy(Deg2Rad(-10.0), 0.0, 0.0));

inline double Seabed(const Eigen::Vector2d& p) {
  return 16.0 + 0.3 * std::sin(0.11 * p.x() + 0.05 * p.y()) + 0.2 * std::sin(0.17 * p.y()) +
         0.05 * std::sin(0.6 * p.x() - 0.4 * p.y());
}

struct Line {
  Eigen::Vector2d begin;
  double heading_rad;
};

// What navigation states at a time of a line. Motions of several periods, other ones on each line.
struct Stated {
  Eigen::Vector3d p;
  Eigen::Vector3d rpy;
  double heave_m;
};

class Vehicle {
 public:
  Vehicle(const Line& line, double phase) : line_(line), phase_(phase) {}
  Stated At(double s) const {
    const auto wave = [&](double period_s, double shift) {
      return std::sin(2.0 * kPi * s / period_s + shift + phase_);
    };
    const double heave_m = 0.08 * wave(6.3, 0.4) + 0.05 * wave(4.4, 2.0);
    const Eigen::Vector2d p =
        line_.begin +
        s * kSpeedMps * Eigen::Vector2d(std::cos(line_.heading_rad), std::sin(line_.heading_rad));
    return {{p.x(), p.y(), 5.0 + heave_m},
            {Deg2Rad(1.5 * wave(5.7, 0.0) + 0.8 * wave(8.3, 1.0)),
             Deg2Rad(0.9 * wave(6.9, 3.0)),
             line_.heading_rad + Deg2Rad(1.0 * wave(7.7, 5.0))},
            heave_m};
  }

 private:
  Line line_;
  double phase_;
};

// The sounding of a beam: where the ray from the true sonar meets the seabed [m of range].
inline double RangeTo(const Eigen::Vector3d& p, const Eigen::Vector3d& direction) {
  double range_m = (Seabed(p.head<2>()) - p.z()) / direction.z();
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d at = p + range_m * direction;
    range_m += (Seabed(at.head<2>()) - at.z()) / direction.z();
  }
  return range_m;
}

// Of each submap: its soundings, and its level frame in the map with its depth.
struct Mapped {
  std::vector<Time> times;
  std::vector<SubmapSoundings> soundings;
  std::vector<Pose2> T_map_level;
  std::vector<double> z_m;
};

// A survey by a sonar with these errors, placed as if it had none.
inline Mapped Simulated(const std::vector<Line>& lines,
                        const SonarCalibration& errors,
                        std::uint32_t seed,
                        const SonarHeads& heads = {kSonar}) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Mapped mapped;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const Vehicle vehicle(lines[l], 1.7 * static_cast<double>(l) + seed);
    const double line_s = kLineM / kSpeedMps, submap_s = kSubmapM / kSpeedMps;
    for (double from_s = 0.0; from_s + 0.5 * submap_s < line_s; from_s += submap_s) {
      const Stated middle = vehicle.At(from_s + 0.5 * submap_s);
      const Pose2 frame{middle.p.x(), middle.p.y(), middle.rpy.z()};
      SubmapSoundings submap;
      for (double s = from_s; s < from_s + submap_s; s += kPingS) {
        const Stated stated = vehicle.At(s);
        Eigen::Vector3d rpy = vehicle.At(s + 1e-3 * errors.attitude_latency_ms).rpy;
        rpy.x() *= 1.0 + 0.01 * errors.roll_scale_percent;
        Eigen::Vector3d p = stated.p;
        p.z() = vehicle.At(s + 1e-3 * errors.depth_latency_ms).p.z() +
                0.01 * errors.heave_scale_percent * stated.heave_m;
        const Eigen::Matrix3d R_stated =
            RotationFromRpy(stated.rpy.x(), stated.rpy.y(), stated.rpy.z());
        SubmapSoundings::Motion motion;
        motion.p_level_m << Inverse(frame) * Eigen::Vector2d(stated.p.head<2>()),
            stated.p.z() - middle.p.z();
        motion.rpy_rad = stated.rpy - Eigen::Vector3d(0.0, 0.0, frame.yaw);
        for (std::size_t head = 0; head < heads.size(); ++head) {
          const Eigen::Isometry3d& sonar = heads[head];
          const double roll_rad = head == 1 ? errors.second_head_roll_rad : errors.roll_rad;
          const Eigen::Matrix3d R = RotationFromRpy(rpy.x() + roll_rad, rpy.y(), rpy.z());
          submap.motions.push_back(motion);
          submap.pings.push_back({kStart + FromSeconds(1000.0 * static_cast<double>(l) + s),
                                  0,
                                  static_cast<std::uint8_t>(head)});
          const double widest_deg = heads.size() > 1 ? 40.0 : 60.0;
          for (int beam = 0; beam < kBeams; ++beam) {
            const double sine = std::sin(Deg2Rad(widest_deg) * (2.0 * beam / (kBeams - 1.0) - 1.0));
            const Eigen::Vector3d ray(0.0, sine, std::sqrt(1.0 - sine * sine));
            const double range_m = RangeTo(p + R * sonar.translation(), R * sonar.linear() * ray);
            const double stated_sine = sine / (1.0 + errors.smile_mps / 1500.0);
            const Eigen::Vector3d stated_ray(
                0.0, stated_sine, std::sqrt(1.0 - stated_sine * stated_sine));
            Eigen::Vector3d at =
                stated.p + R_stated * (sonar.translation() + (range_m + 0.01 * normal(random)) *
                                                                 (sonar.linear() * stated_ray));
            at.head<2>() = Inverse(frame) * Eigen::Vector2d(at.head<2>());
            at.z() -= middle.p.z();
            submap.soundings.push_back({at.cast<float>(),
                                        static_cast<std::uint32_t>(submap.pings.size() - 1),
                                        static_cast<std::uint16_t>(beam),
                                        true});
          }
        }
      }
      mapped.times.push_back(submap.pings[submap.pings.size() / 2].time);
      // Registration leaves a few centimetres.
      mapped.T_map_level.push_back(
          {frame.x + 0.02 * normal(random), frame.y + 0.02 * normal(random), frame.yaw});
      mapped.z_m.push_back(middle.p.z() + 0.01 * normal(random));
      mapped.soundings.push_back(std::move(submap));
    }
  }
  return mapped;
}

const inline std::vector<Line> kThreeAndACross{
    {{0.0, 0.0}, 0.0}, {{kLineM, 14.0}, kPi}, {{0.0, 28.0}, 0.0}, {{60.0, -40.0}, kPi / 2.0}};

}  // namespace seastitch::test
