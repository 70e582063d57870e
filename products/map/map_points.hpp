#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/core/grid.hpp"
#include "products/survey.hpp"

// Points of a survey in the map, for rasters: north, east, depth.
namespace seastitch {

// Axes of a survey's map frame. Ours are North-East-Down. Imported submaps may have z up; their x
// is then east and their y north.
enum class MapAxes { kNorthEastDown, kEastNorthUp };

// North, east, depth (positive down) of a point in the map frame.
inline Eigen::Vector3d ToNorthEastDown(const Eigen::Vector3d& p_map, MapAxes axes) {
  if (axes == MapAxes::kNorthEastDown) return p_map;
  return {p_map.y(), p_map.x(), -p_map.z()};
}
inline Eigen::Vector2d ToNorthEast(const Eigen::Vector2d& p_map, MapAxes axes) {
  if (axes == MapAxes::kNorthEastDown) return p_map;
  return {p_map.y(), p_map.x()};
}

struct MapPoint {
  Eigen::Vector3d p_ned = Eigen::Vector3d::Zero();  // [m]
  double soundings = 1.0;                           // number that it is the mean of
};

// Cloud of a submap from its file, sheared by its dive's mounting errors; empty without points.
// Throws std::runtime_error naming the file.
PointCloud LoadCloud(const SurveySubmap& submap, const MountingErrors& mounting);

// Points of submap i in the map.
std::vector<MapPoint> LoadMapPoints(const std::vector<SurveySubmap>& submaps,
                                    const SurveyPoses& poses,
                                    std::size_t i,
                                    MapAxes axes);

// North and east extent of the points of submap i; empty (isEmpty()) without points.
Eigen::AlignedBox2d NorthEastBox(const std::vector<SurveySubmap>& submaps,
                                 const SurveyPoses& poses,
                                 std::size_t i,
                                 MapAxes axes);

// A cell of 1, 2 or 5 times a power of ten metres that holds about four points of one submap:
// twice the median point spacing, rounded up. At least 0.05 m.
double DefaultCell(const std::vector<SurveySubmap>& submaps);

// The next larger of 1, 2, 5 times a power of ten; the value itself where it is one.
double RoundUpOneTwoFive(double value);

}  // namespace seastitch
