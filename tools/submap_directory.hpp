#pragma once

#include <filesystem>
#include <vector>

#include "common/core/submap.hpp"

namespace seastitch {

// What the maker of imported submaps knew of his dead reckoning, between consecutive submaps.
struct ImportedDrift {
  double sigma_xy_m = 0.5;  // a direction: 1 to 3 % of some 20 m, the class of AHRS and DVL
  double sigma_yaw_deg = 0.6;
};

struct SubmapDirectory {
  std::vector<Submap> submaps;  // by rising id
  // The map frame has z up: its points lie above their vehicle in z-down axes, and a sonar looks
  // down.
  bool z_up = false;
};

// Reads every .pcd and .pdc file of a directory as a submap: id = first number in the file's name,
// frame = VIEWPOINT. Times are one second an id. Throws std::runtime_error "DIR: no submaps ..." or
// naming the file and what is wrong with it.
SubmapDirectory ReadSubmapDirectory(const std::filesystem::path& dir, const ImportedDrift& drift);

}  // namespace seastitch
