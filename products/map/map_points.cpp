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

PointCloud LoadCloud(const SurveySubmap& submap, double shear_rad) {
  if (submap.points == 0) return {};
  PointCloud cloud = ReadSubmapPcd(submap.cloud_file).cloud;
  if (shear_rad == 0.0) return cloud;
  const Eigen::Matrix3d straight = LevelFromBody(submap.T_map_submap).transpose() *
                                   StraightFromBody(submap.T_map_submap, shear_rad);
  for (Eigen::Vector3f& point : cloud.points)
    point = (straight * point.cast<double>()).cast<float>();
  return cloud;
}

std::vector<MapPoint> LoadMapPoints(const std::vector<SurveySubmap>& submaps,
                                    const SurveyPoses& poses,
                                    std::size_t i,
                                    const MapProjection& projection) {
  const PointCloud cloud = LoadCloud(submaps[i], poses.ShearOf(i));
  const Eigen::Isometry3d T_map_submap = SubmapPose(submaps[i], poses.T_map_level[i]);
  std::vector<Eigen::Vector3d> p_ned;
  p_ned.reserve(cloud.size());
  for (const Eigen::Vector3f& p : cloud.points)
    p_ned.push_back(ToNorthEastDown(T_map_submap * p.cast<double>(), projection.axes()));
  const std::vector<Eigen::Vector2d> north_east = projection.NorthEast(p_ned);
  std::vector<MapPoint> points;
  points.reserve(cloud.size());
  for (std::size_t k = 0; k < cloud.size(); ++k)
    points.push_back({p_ned[k], north_east[k], static_cast<double>(cloud.soundings[k])});
  return points;
}

Eigen::AlignedBox2d NorthEastBox(const std::vector<SurveySubmap>& submaps,
                                 const SurveyPoses& poses,
                                 std::size_t i,
                                 const MapProjection& projection) {
  // The hull was made from the same points in double. The slack covers the rounding of shearing
  // and placing them in float, and the bend of the hull's straight sides by the projection.
  constexpr double kSlackM = 0.01;
  // Where a point lies in the files depends a little on its depth. The altitude is not known here:
  // half a swath is no smaller than it, for a swath of 90 degrees and more.
  Eigen::AlignedBox2d level;
  for (const Eigen::Vector2d& corner : submaps[i].hull) level.extend(corner);
  if (level.isEmpty()) return level;
  const double down_m = submaps[i].T_map_submap.translation().z();
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& corner : submaps[i].hull) {
    const Eigen::Vector2d at =
        poses.T_map_level[i] * (corner + Shear(corner, poses.ShearOf(i))).eval();
    for (const double below_m : {0.0, level.diagonal().norm()})
      corners.push_back(ToNorthEastDown({at.x(), at.y(), down_m + below_m}, projection.axes()));
  }
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : projection.NorthEast(corners)) box.extend(corner);
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
