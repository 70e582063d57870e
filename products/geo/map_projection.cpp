#include "products/geo/map_projection.hpp"

#include <Eigen/Geometry>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <array>
#include <mutex>
#include <stdexcept>

#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"
#include "products/geo/geographic_converter.hpp"

namespace seastitch {
namespace {

// Fewer points than this are projected one by one.
constexpr std::size_t kFewPoints = 64;
// The error of the polynomial is below 1 mm over so long a side and such differences of depth, at
// 80 km from the map's origin and at 82 degrees of latitude.
constexpr double kLargestPatchM = 5000.0, kLargestDepthsM = 1000.0;

std::string UtmOf(const Datum& point) {
  const int zone = GeographicLib::UTMUPS::StandardZone(point.latitude_deg, point.longitude_deg);
  const bool north = point.latitude_deg >= 0.0;
  if (zone == GeographicLib::UTMUPS::UPS) return north ? "EPSG:32661" : "EPSG:32761";
  return "EPSG:" + std::to_string((north ? 32600 : 32700) + zone);
}

// Throws where the system cannot be that of a map at `origin`.
GeographicConverter Metric(const std::string& crs, const Datum& origin) {
  std::string reason;
  try {
    GeographicConverter converter(crs);
    if (crs.find('+') != std::string::npos && crs.starts_with("EPSG:"))
      reason = "has a vertical system: that is stated by vertical_datum in mapper.yaml";
    else if (!converter.is_metric())
      reason = "is not in metres";
    else if (!converter.IsMadeFor(origin))
      reason = converter.name() + " is not made for the place of the survey";
    else
      return converter;
  } catch (const std::exception& e) {
    reason = e.what();
  }
  throw std::runtime_error("map files in " + crs + ": " + reason +
                           "; expected a projection in metres, such as EPSG:32632");
}

// A polynomial through exact values at nodes 0, 1/2 and 1 of a box: quadratic in north and east; in
// depth linear, with a gradient that is linear in north and east.
class Patch {
 public:
  template <class Project>
  Patch(const Eigen::AlignedBox3d& box, const Project& project)
      : min_(box.min()), per_m_(box.sizes().cwiseMax(1e-9).cwiseInverse()) {
    std::vector<Eigen::Vector3d> nodes;
    const auto add = [&](double u, double v, double w) {
      nodes.push_back(box.min() + box.sizes().cwiseProduct(Eigen::Vector3d(u, v, w)));
    };
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) add(0.5 * i, 0.5 * j, 0.0);
    add(0.0, 0.0, 1.0);
    add(1.0, 0.0, 1.0);
    add(0.0, 1.0, 1.0);
    const std::vector<Eigen::Vector2d> at = project(nodes);
    // Along east for each node of north, then along north.
    std::array<std::array<Eigen::Vector2d, 3>, 3> along_east;
    for (std::size_t i = 0; i < 3; ++i)
      along_east[i] = Quadratic(at[3 * i], at[3 * i + 1], at[3 * i + 2]);
    for (std::size_t j = 0; j < 3; ++j)
      terms_[j] = Quadratic(along_east[0][j], along_east[1][j], along_east[2][j]);
    depth_[0] = at[9] - at[0];
    depth_[1] = at[10] - at[6] - depth_[0];
    depth_[2] = at[11] - at[2] - depth_[0];
  }

  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d u = (p - min_).cwiseProduct(per_m_);
    const auto along_north = [&](const std::array<Eigen::Vector2d, 3>& t) -> Eigen::Vector2d {
      return t[0] + u.x() * (t[1] + u.x() * t[2]);
    };
    return along_north(terms_[0]) +
           u.y() * (along_north(terms_[1]) + u.y() * along_north(terms_[2])) +
           u.z() * (depth_[0] + u.x() * depth_[1] + u.y() * depth_[2]);
  }

 private:
  // Coefficients of 1, u, u^2 from the values at 0, 1/2 and 1.
  static std::array<Eigen::Vector2d, 3> Quadratic(const Eigen::Vector2d& at_0,
                                                  const Eigen::Vector2d& at_half,
                                                  const Eigen::Vector2d& at_1) {
    return {at_0, 4.0 * at_half - 3.0 * at_0 - at_1, 2.0 * (at_0 + at_1) - 4.0 * at_half};
  }

  Eigen::Vector3d min_, per_m_;
  std::array<std::array<Eigen::Vector2d, 3>, 3> terms_;  // by powers of east, then of north
  std::array<Eigen::Vector2d, 3> depth_;
};

}  // namespace

bool IsHeightSystem(int epsg) {
  try {
    const std::string wkt = WktOf("EPSG:" + std::to_string(epsg));
    return wkt.starts_with("VERT_CS[") && wkt.find(",UP]") != std::string::npos;
  } catch (const std::exception&) {
    return false;
  }
}

class MapProjection::Exact {
 public:
  Exact(const Datum& origin, const std::string& crs) : frame_(origin), crs_(Metric(crs, origin)) {}

  std::vector<Eigen::Vector2d> operator()(const std::vector<Eigen::Vector3d>& p_ned) const {
    std::vector<Eigen::Vector2d> points;
    points.reserve(p_ned.size());
    for (const Eigen::Vector3d& p : p_ned) {
      const Datum at = frame_.PointAt(p.head<2>(), p.z());
      points.emplace_back(Deg2Rad(at.latitude_deg), Deg2Rad(at.longitude_deg));
    }
    {
      const std::lock_guard lock(mutex_);  // GDAL's transformation serves one thread at a time
      crs_.Project(&points);
    }
    for (const Eigen::Vector2d& p : points)
      if (!p.allFinite()) throw std::runtime_error(crs_.name() + " does not reach the survey");
    return points;
  }

 private:
  MapFrame frame_;
  GeographicConverter crs_;
  mutable std::mutex mutex_;
};

MapProjection::MapProjection(const Datum& origin,
                             const Eigen::Vector2d& middle,
                             const std::string& crs,
                             int vertical_epsg)
    : horizontal_(crs.empty() ? UtmOf(MapFrame(origin).PointAt(middle)) : crs),
      compound_(horizontal_),
      exact_(std::make_shared<const Exact>(origin, horizontal_)) {
  if (vertical_epsg == 0) return;
  vertical_ = "EPSG:" + std::to_string(vertical_epsg);
  if (!IsHeightSystem(vertical_epsg))
    throw std::runtime_error(vertical_ + " is no reference system of heights");
  if (horizontal_.starts_with("EPSG:")) compound_ += "+" + std::to_string(vertical_epsg);
}

std::string MapProjection::Wkt() const { return has_crs() ? WktOf(compound_) : std::string(); }

std::vector<Eigen::Vector2d> MapProjection::NorthEast(
    const std::vector<Eigen::Vector3d>& p_ned) const {
  std::vector<Eigen::Vector2d> points;
  points.reserve(p_ned.size());
  if (!has_crs()) {
    for (const Eigen::Vector3d& p : p_ned) points.push_back(p.head<2>());
    return points;
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : p_ned) box.extend(p);
  if (p_ned.size() < kFewPoints || box.sizes().head<2>().maxCoeff() > kLargestPatchM ||
      box.sizes().z() > kLargestDepthsM)
    return (*exact_)(p_ned);
  const Patch patch(box, *exact_);
  for (const Eigen::Vector3d& p : p_ned) points.push_back(patch(p));
  return points;
}

Eigen::Vector2d MapProjection::NorthEast(const Eigen::Vector3d& p_ned) const {
  return NorthEast(std::vector<Eigen::Vector3d>{p_ned}).front();
}

}  // namespace seastitch
