#include "products/geo/map_projection.hpp"

#include <Eigen/Geometry>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <array>
#include <stdexcept>

#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"
#include "products/geo/geographic_converter.hpp"

namespace seastitch {
namespace {

// Fewer points than this are projected one by one.
constexpr std::size_t kFewPoints = 64;
// The error of a quadratic over so long a side, by the third derivatives of a conformal projection
// (1 / R^2), is below 0.2 mm.
constexpr double kLargestPatchM = 10'000.0;

std::string UtmOf(const Datum& point) {
  const int zone =
      GeographicLib::UTMUPS::StandardZone(point.latitude_deg, point.longitude_deg);
  const bool north = point.latitude_deg >= 0.0;
  if (zone == GeographicLib::UTMUPS::UPS) return north ? "EPSG:32661" : "EPSG:32761";
  return "EPSG:" + std::to_string((north ? 32600 : 32700) + zone);
}

GeographicConverter Metric(const std::string& crs) {
  const auto wrong = [&](const std::string& reason) {
    return std::runtime_error("--crs " + crs + ": " + reason +
                              "; expected a projection in metres, such as EPSG:32632");
  };
  try {
    GeographicConverter converter(crs);
    if (converter.is_metric()) return converter;
  } catch (const std::exception& e) {
    throw wrong(e.what());
  }
  throw wrong("is not in metres");
}

// A polynomial through exact values: quadratic in north and east, linear in depth.
class Patch {
 public:
  template <class Project>
  Patch(const Eigen::AlignedBox3d& box, const Project& project) : box_(box) {
    std::vector<Eigen::Vector3d> nodes;
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          nodes.push_back(box.min() +
                          box.sizes().cwiseProduct(Eigen::Vector3d(0.5 * i, 0.5 * j, 1.0 * k)));
    const std::vector<Eigen::Vector2d> values = project(nodes);
    std::copy(values.begin(), values.end(), values_.begin());
  }

  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d u =
        (p - box_.min()).cwiseQuotient(box_.sizes().cwiseMax(1e-9)).cwiseMin(1.0).cwiseMax(0.0);
    const Eigen::Vector3d north = Lagrange(u.x()), east = Lagrange(u.y());
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    std::size_t node = 0;
    for (int k = 0; k < 2; ++k) {
      const double by_depth = k == 0 ? 1.0 - u.z() : u.z();
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) sum += by_depth * north(i) * east(j) * values_[node++];
    }
    return sum;
  }

 private:
  // Of the nodes 0, 1/2, 1.
  static Eigen::Vector3d Lagrange(double u) {
    return {(2.0 * u - 1.0) * (u - 1.0), 4.0 * u * (1.0 - u), u * (2.0 * u - 1.0)};
  }

  Eigen::AlignedBox3d box_;
  std::array<Eigen::Vector2d, 18> values_;
};

}  // namespace

class MapProjection::Exact {
 public:
  Exact(const Datum& origin, const std::string& crs) : frame_(origin), crs_(Metric(crs)) {}

  std::vector<Eigen::Vector2d> operator()(const std::vector<Eigen::Vector3d>& p_ned) const {
    std::vector<Eigen::Vector2d> points;
    points.reserve(p_ned.size());
    for (const Eigen::Vector3d& p : p_ned) {
      const Datum at = frame_.PointAt(p.head<2>(), p.z());
      points.emplace_back(Deg2Rad(at.latitude_deg), Deg2Rad(at.longitude_deg));
    }
    crs_.Project(&points);
    for (const Eigen::Vector2d& p : points)
      if (!p.allFinite())
        throw std::runtime_error(crs_.name() + " does not reach the survey: choose another --crs");
    return points;
  }

 private:
  MapFrame frame_;
  GeographicConverter crs_;
};

MapProjection::MapProjection(const Datum& origin,
                             const Eigen::Vector2d& middle,
                             const std::string& crs,
                             int vertical_epsg)
    : horizontal_(crs.empty() ? UtmOf(MapFrame(origin).PointAt(middle)) : crs),
      compound_(horizontal_),
      exact_(std::make_shared<const Exact>(origin, horizontal_)) {
  if (vertical_epsg != 0 && horizontal_.starts_with("EPSG:"))
    compound_ += "+" + std::to_string(vertical_epsg);
}

std::string MapProjection::Wkt() const { return has_crs() ? WktOf(compound_) : std::string(); }

std::vector<Eigen::Vector2d> MapProjection::NorthEast(
    const std::vector<Eigen::Vector3d>& p_ned) const {
  std::vector<Eigen::Vector2d> points;
  if (!has_crs()) {
    for (const Eigen::Vector3d& p : p_ned) points.push_back(p.head<2>());
    return points;
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : p_ned) box.extend(p);
  if (p_ned.size() < kFewPoints || box.sizes().head<2>().maxCoeff() > kLargestPatchM)
    return (*exact_)(p_ned);
  const Patch patch(box, *exact_);
  points.reserve(p_ned.size());
  for (const Eigen::Vector3d& p : p_ned) points.push_back(patch(p));
  return points;
}

Eigen::Vector2d MapProjection::NorthEast(const Eigen::Vector3d& p_ned) const {
  return NorthEast(std::vector<Eigen::Vector3d>{p_ned}).front();
}

}  // namespace seastitch
