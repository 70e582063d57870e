#pragma once

#include <filesystem>
#include <string>

#include "common/core/submap.hpp"

// Submaps as PCD files: points in the submap frame [m], T_map_submap in VIEWPOINT, fields x y z
// intensity (intensity: number of soundings that the point is the mean of). PCL and the paper's
// reference code can read them.
namespace seastitch {

// Beside the files of a dive's submaps: a line of JSON for each, with what its PCD file lacks.
inline constexpr char kSubmapIndex[] = "index.jsonl";

// What a power cut may do to a file that was just written.
enum class PowerCut { kMayLoseFile, kLeavesFile };

// Writes binary PCD, with a checksum in a comment, to a temporary file and renames it. T_map_submap
// goes to VIEWPOINT (PCL keeps it as float: the exact pose belongs in poses.txt). kLeavesFile
// flushes the file to the disk, for which it waits. Throws std::runtime_error naming the file.
void WriteSubmapPcd(const std::filesystem::path& path,
                    const PointCloud& cloud,
                    const Eigen::Isometry3d& T_map_submap,
                    PowerCut power_cut = PowerCut::kMayLoseFile);

// Cloud and frame of a PCD file (ascii, binary, compressed; with or without intensity). Points that
// are not finite are left out. The VIEWPOINT is read from the header as double. Throws
// std::runtime_error "FILE: reason" for anything that is not a PCD file with x, y and z, and where
// the file has our checksum and another content.
struct SubmapPcd {
  PointCloud cloud;
  Eigen::Isometry3d T_map_submap = Eigen::Isometry3d::Identity();
};
SubmapPcd ReadSubmapPcd(const std::filesystem::path& path);

}  // namespace seastitch
