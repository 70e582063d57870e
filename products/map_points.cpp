#include "products/map_points.hpp"

#include <algorithm>
#include <cmath>

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

std::vector<MapPoint> LoadMapPoints(const SurveySubmap& submap,
                                    const Pose2& T_map_level,
                                    MapAxes axes) {
  std::vector<MapPoint> points;
  if (submap.points == 0) return points;
  const PointCloud cloud = ReadSubmapPcd(submap.cloud_file).cloud;
  const Eigen::Isometry3d T_map_submap = SubmapPose(submap, T_map_level);
  points.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p_map = T_map_submap * cloud.points[i].cast<double>();
    points.push_back({ToNorthEastDown(p_map, axes), static_cast<double>(cloud.soundings[i])});
  }
  return points;
}

Eigen::AlignedBox2d NorthEastBox(const SurveySubmap& submap,
                                 const Pose2& T_map_level,
                                 MapAxes axes) {
  // The hull was made from the same points in double; this covers the rounding between the two.
  constexpr double kSlackM = 1e-6;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : submap.hull) {
    box.extend(ToNorthEast(T_map_level * corner, axes));
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
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  return RoundUpOneTwoFive(std::max(2.0 * *middle, kSmallestCellM));
}

}  // namespace seastitch
