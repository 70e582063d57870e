#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/geo/datum.hpp"

namespace seastitch {

// Coordinates in a reference system that a file states, as latitude and longitude on WGS 84, and
// back.
class GeographicConverter {
 public:
  // crs: WKT, "EPSG:32632", or a PROJ string. Throws std::runtime_error with GDAL's reason.
  explicit GeographicConverter(const std::string& crs);
  ~GeographicConverter();
  GeographicConverter(GeographicConverter&&) noexcept;
  GeographicConverter(const GeographicConverter&) = delete;
  GeographicConverter& operator=(const GeographicConverter&) = delete;

  const std::string& name() const { return name_; }
  // Length of a unit of z: of the vertical system, else of the grid.
  double z_unit_m() const { return z_unit_m_; }
  // The system states depths, not heights.
  bool z_is_down() const { return z_is_down_; }
  // The system is a projection whose unit is the metre.
  bool is_metric() const { return is_metric_; }
  // False: a point [deg] lies far outside of the area for which the system is made, by its
  // register. True where that states none.
  bool IsMadeFor(const Datum& point) const;
  // From east (or longitude) and north (or latitude), in the system's units, to latitude and
  // longitude [rad]. NaN: the system does not reach there.
  void Convert(std::vector<Eigen::Vector2d>* points) const;
  // From latitude and longitude [rad] to north and east, in the system's units. NaN as above.
  void Project(std::vector<Eigen::Vector2d>* points) const;

 private:
  struct Transformation;
  std::unique_ptr<Transformation> transformation_;
  std::string name_;
  double z_unit_m_ = 1.0;
  bool z_is_down_ = false;
  bool is_metric_ = false;
  std::optional<std::array<double, 4>> area_deg_;  // west, south, east, north
};

// A reference system as text (WKT 1). Throws std::runtime_error with GDAL's reason.
std::string WktOf(const std::string& crs);

}  // namespace seastitch
