#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "products/geo/map_projection.hpp"
#include "products/survey.hpp"

// Points of a survey in the map, for rasters: north, east, depth.
namespace seastitch {

struct MapPoint {
  Eigen::Vector3d p_ned = Eigen::Vector3d::Zero();       // in the map frame [m]
  Eigen::Vector2d north_east = Eigen::Vector2d::Zero();  // in the map's files [m]
  double soundings = 1.0;                                // number that it is the mean of
};

// Cloud of a submap from its file, sheared by an angle of the DVL (SurveyPoses::ShearOf()); empty
// without points. Throws std::runtime_error naming the file.
PointCloud LoadCloud(const SurveySubmap& submap, double shear_rad);

// Points of submap i in the map.
std::vector<MapPoint> LoadMapPoints(const std::vector<SurveySubmap>& submaps,
                                    const SurveyPoses& poses,
                                    std::size_t i,
                                    const MapProjection& projection);

// North and east extent, in the map's files, of the points of submap i; empty (isEmpty()) without
// points.
Eigen::AlignedBox2d NorthEastBox(const std::vector<SurveySubmap>& submaps,
                                 const SurveyPoses& poses,
                                 std::size_t i,
                                 const MapProjection& projection);

// A cell of 1, 2 or 5 times a power of ten metres that holds about four points of one submap:
// twice the median point spacing, rounded up. At least 0.05 m.
double DefaultCell(const std::vector<SurveySubmap>& submaps);

// The next larger of 1, 2, 5 times a power of ten; the value itself where it is one.
double RoundUpOneTwoFive(double value);

}  // namespace seastitch
