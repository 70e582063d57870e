#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "common/geo/datum.hpp"

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

// True: the EPSG code is that of a vertical reference system of heights (positive up).
bool IsHeightSystem(int epsg);

// Where the points of a map frame lie in map files: north and east [m] of a projected coordinate
// reference system (CRS), or of the map frame itself where that has no known origin. Every point
// is projected by itself: no raster is warped.
class MapProjection {
 public:
  // Without a CRS: north and east of the map frame.
  explicit MapProjection(MapAxes axes = MapAxes::kNorthEastDown) : axes_(axes) {}

  // origin: of a map frame North-East-Down. crs: such as "EPSG:25832"; empty: the UTM zone on
  // WGS 84 of `middle` (north and east of the survey's middle), with the exceptions of zones 31 to
  // 37 (32V, Svalbard), and UPS beyond 84 degrees north and 80 degrees south. vertical_epsg: EPSG
  // code of the system of heights in which elevations count; 0: unknown. Throws std::runtime_error
  // that names a CRS that is unknown, not in metres or made for another place, or a code that is no
  // system of heights.
  MapProjection(const Datum& origin,
                const Eigen::Vector2d& middle,
                const std::string& crs,
                int vertical_epsg);

  MapAxes axes() const { return axes_; }
  bool has_crs() const { return exact_ != nullptr; }
  // Name of the horizontal system, such as "EPSG:32632"; empty without.
  const std::string& horizontal() const { return horizontal_; }
  // Vertical system of elevations, such as "EPSG:5829"; empty: unknown.
  const std::string& vertical() const { return vertical_; }
  // Both, such as "EPSG:32632+5829"; a horizontal system without an EPSG code stands alone.
  const std::string& compound() const { return compound_; }
  // compound() as text (WKT 1); empty without a CRS.
  std::string Wkt() const;

  // North and east of points of the map frame, given as north, east, down. Within 1 mm where they
  // lie within 5 km of each other, else exact. Throws std::runtime_error where the CRS does not
  // reach them.
  std::vector<Eigen::Vector2d> NorthEast(const std::vector<Eigen::Vector3d>& p_ned) const;
  Eigen::Vector2d NorthEast(const Eigen::Vector3d& p_ned) const;

 private:
  class Exact;
  MapAxes axes_ = MapAxes::kNorthEastDown;
  std::string horizontal_;
  std::string vertical_;
  std::string compound_;
  std::shared_ptr<const Exact> exact_;
};

}  // namespace seastitch
