#pragma once

#include <filesystem>
#include <vector>

#include "common/core/submap.hpp"

namespace seastitch {

// Drift of dead reckoning between consecutive imported submaps, 1 sigma. The defaults are rather
// too large: a search window that does not contain the truth loses the closure.
struct ImportedDrift {
  double sigma_xy_m = 1.0;  // x and y each; 5 % of the usual 20 m between frames
  double sigma_yaw_deg = 1.0;
};

struct SubmapDirectory {
  std::vector<Submap> submaps;  // by rising id
  // True: z of the map frame is positive up. Detected from the points: in z-down axes they would be
  // above the vehicle.
  bool z_up = false;
};

// Whether a directory has a .pcd or .pdc file.
bool HoldsSubmaps(const std::filesystem::path& dir);

// Reads every .pcd and .pdc file of a directory as a submap: id = first number in the file's name,
// frame = VIEWPOINT. Times are one second an id. Throws std::runtime_error "DIR: no submaps ..." or
// naming the file and what is wrong with it.
SubmapDirectory ReadSubmapDirectory(const std::filesystem::path& dir, const ImportedDrift& drift);

}  // namespace seastitch
