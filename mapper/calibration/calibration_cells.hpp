#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/core/placed_soundings.hpp"

namespace seastitch {

// Errors of integration that the overlaps of a survey are fitted with, each as what has to be added
// to the configuration. Those of SonarCalibration are applied; pitch, yaw and
// the lever arm may exist and are never applied here. SI units: radians, metres, seconds; a smile
// and a sound speed as a part of 1500 m/s; scales as a part of the whole.
enum class IntegrationError : std::uint8_t {
  kRoll,  // of head 0
  kSecondHeadRoll,
  kSmile,
  kAttitudeLatency,
  kDepthLatency,
  kRollScale,
  kHeaveScale,
  kPitch,
  kYaw,
  kProfile,  // sound speed of the whole water
  kForward,  // lever arm of the sonar
  kStarboard,
};
inline constexpr std::size_t kIntegrationErrors = 12;

// Part of the seabed that one submap measured, in the level frame of the submap [m].
struct CalibrationCell {
  std::array<float, 3> mean_m{};                     // of its soundings
  std::array<float, 2> slope{};                      // of the seabed, inside this submap
  std::array<float, kIntegrationErrors> by_error{};  // change of its height by each error
  float angle_rad = 0.0f;                            // mean of the beams' angles from the vertical
  float variance_m2 = 0.0f;                          // of its soundings about the slope
  float soundings = 0.0f;
};

// Cells of one submap, by place.
struct CalibrationCells {
  double cell_m = 0.0;  // side of a cell
  std::vector<CalibrationCell> cells;

  // Cell that contains a place in the level frame [m]; null: none. Sort() first.
  const CalibrationCell* At(const Eigen::Vector2d& p_level_m) const;
  // Puts the cells in the order that At() needs.
  void Sort();
};

// Cells of a submap's used soundings: side kCellPerAltitude of the median altitude. A cell has at
// least three soundings, and a slope that the nine cells around it determine. The change of height
// by each error is taken on the plane of the cell, at the middle of the cell across the track: a
// sounding's own noise would otherwise be in its regressor. T_vehicle_sonar: place and axes of the
// receive array of each head, two at most. Empty where the submap has no motions, or pings of
// another head.
using SonarHeads = std::vector<Eigen::Isometry3d>;
CalibrationCells CellsOf(const SubmapSoundings& submap, const SonarHeads& T_vehicle_sonar);

// Side of a cell, as a part of the altitude.
inline constexpr double kCellPerAltitude = 0.08;

}  // namespace seastitch
