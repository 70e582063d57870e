#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/grid.hpp"

// Rasters and vector layers as the bytes of a file. The only code that uses GDAL.
namespace seastitch {

// Map origin, WGS 84, degrees.
struct Datum {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

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

// A GeoPackage with the same projection as GeoTiff(). Throws std::runtime_error.
std::string GeoPackage(const std::vector<VectorLayer>& layers, const std::optional<Datum>& datum);

}  // namespace seastitch
