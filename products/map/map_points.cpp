#include "products/map/map_points.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/median.hpp"
#include "common/core/mounting.hpp"
#include "common/storage/submap_file.hpp"

namespace seastitch {
namespace {

constexpr double kSmallestCellM = 0.05;

double Area(const Footprint& corners) {
  double twice = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * std::abs(twice);
}

}  // namespace

PointCloud LoadCloud(const SurveySubmap& submap, const MountingErrors& mounting) {
  if (submap.points == 0) return {};
  PointCloud cloud = ReadSubmapPcd(submap.cloud_file).cloud;
  if (mounting.dvl_yaw_rad == 0.0) return cloud;
  const Eigen::Matrix3d R_level_submap = LevelFromBody(submap.T_map_submap);
  for (Eigen::Vector3f& point : cloud.points) {
    Eigen::Vector3d p_level = R_level_submap * point.cast<double>();
    p_level.head<2>() += Shear(p_level.head<2>(), mounting);
    point = (R_level_submap.transpose() * p_level).cast<float>();
  }
  return cloud;
}

std::vector<MapPoint> LoadMapPoints(const std::vector<SurveySubmap>& submaps,
                                    const SurveyPoses& poses,
                                    std::size_t i,
                                    MapAxes axes) {
  const PointCloud cloud = LoadCloud(submaps[i], poses.MountingOf(i));
  const Eigen::Isometry3d T_map_submap = SubmapPose(submaps[i], poses.T_map_level[i]);
  std::vector<MapPoint> points;
  points.reserve(cloud.size());
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    const Eigen::Vector3d p_map = T_map_submap * cloud.points[k].cast<double>();
    points.push_back({ToNorthEastDown(p_map, axes), static_cast<double>(cloud.soundings[k])});
  }
  return points;
}

Eigen::AlignedBox2d NorthEastBox(const std::vector<SurveySubmap>& submaps,
                                 const SurveyPoses& poses,
                                 std::size_t i,
                                 MapAxes axes) {
  // The hull was made from the same points in double; this covers the rounding of shearing and
  // placing them in float.
  constexpr double kSlackM = 1e-3;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : submaps[i].hull) {
    const Eigen::Vector2d sheared = corner + Shear(corner, poses.MountingOf(i));
    box.extend(ToNorthEast(poses.T_map_level[i] * sheared, axes));
  }
  if (!box.isEmpty()) {
    box.min().array() -= kSlackM;
    box.max().array() += kSlackM;
  }
  return box;
}

double RoundUpOneTwoFive(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * decade * (1.0 + 1e-9)) return step * decade;
  }
  return 10.0 * decade;
}

double DefaultCell(const std::vector<SurveySubmap>& submaps) {
  std::vector<double> spacings;
  for (const SurveySubmap& s : submaps) {
    const double area = Area(s.hull);
    if (area > 0.0) spacings.push_back(std::sqrt(area / static_cast<double>(s.points)));
  }
  if (spacings.empty()) return 1.0;
  return RoundUpOneTwoFive(std::max(2.0 * Median(std::move(spacings)), kSmallestCellM));
}

}  // namespace seastitch
