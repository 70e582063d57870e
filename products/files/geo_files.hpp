#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/grid.hpp"
#include "common/geo/datum.hpp"

// Rasters and vector layers as the bytes of a file, and coordinates of other reference systems. The
// only code that uses GDAL.
namespace seastitch {

// The projection of every file with this datum, as text (WKT 1).
std::string ProjectionWkt(const Datum& datum);

constexpr float kNoData = -9999.0f;

struct RasterBand {
  std::string description;
  std::string unit;           // "m" or empty
  std::vector<float> values;  // in the grid's order; kNoData: no value
};

// A tiled, deflated GeoTIFF of floats, north up. Grid rows run north and columns east. With a
// datum: azimuthal equidistant projection about it on WGS 84, x = east, y = north [m]. Without: x,
// y in metres and no projection. The file has no creation time, so that the same map gives the same
// bytes. Throws std::runtime_error with GDAL's reason.
std::string GeoTiff(const GridGeometry& geometry,
                    const std::vector<RasterBand>& bands,
                    const std::optional<Datum>& datum);

struct VectorField {
  std::string name;
  std::variant<double, std::string> value;  // a number that is not finite is written as null
};

struct VectorFeature {
  std::vector<Eigen::Vector2d> north_east;  // corners [m]; a polygon's are not closed
  std::vector<VectorField> fields;          // the same names in every feature of a layer
};

struct VectorLayer {
  std::string name;
  bool polygons = false;  // else lines
  std::vector<VectorFeature> features;
};

// Coordinates in a reference system that a file states, as latitude and longitude on WGS 84.
class GeographicConverter {
 public:
  // crs: WKT, "EPSG:32632", or a PROJ string. Throws std::runtime_error with GDAL's reason.
  explicit GeographicConverter(const std::string& crs);
  ~GeographicConverter();
  GeographicConverter(const GeographicConverter&) = delete;
  GeographicConverter& operator=(const GeographicConverter&) = delete;

  const std::string& name() const { return name_; }
  // Length of a unit of z: of the vertical system, else of the grid.
  double z_unit_m() const { return z_unit_m_; }
  // The system states depths, not heights.
  bool z_is_down() const { return z_is_down_; }
  // From east (or longitude) and north (or latitude), in the system's units, to latitude and
  // longitude [rad]. NaN: the system does not reach there.
  void Convert(std::vector<Eigen::Vector2d>* points) const;

 private:
  struct Transformation;
  std::unique_ptr<Transformation> transformation_;
  std::string name_;
  double z_unit_m_ = 1.0;
  bool z_is_down_ = false;
};

// A GeoPackage with the same projection as GeoTiff(). Throws std::runtime_error.
std::string GeoPackage(const std::vector<VectorLayer>& layers, const std::optional<Datum>& datum);

}  // namespace seastitch
