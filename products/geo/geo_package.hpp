#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/core/time.hpp"
#include "products/geo/map_projection.hpp"

namespace seastitch {

struct VectorField {
  std::string name;
  // A number that is not finite, and a time at the epoch, are written as null.
  std::variant<std::int64_t, double, std::string, Time> value;
};

struct VectorFeature {
  std::vector<Eigen::Vector2d> north_east;  // corners [m]; a polygon's are not closed
  std::vector<VectorField> fields;          // the same names and types in every feature of a layer
};

enum class VectorShape : std::uint8_t { kPoints, kLines, kPolygons };

struct VectorLayer {
  std::string name;
  VectorShape shape = VectorShape::kLines;
  std::vector<VectorFeature> features;
};

// The bytes of a GeoPackage in the horizontal system of the projection. Layers without features
// have no fields. The same layers give the same bytes. Throws std::runtime_error with GDAL's
// reason.
std::string GeoPackage(const std::vector<VectorLayer>& layers, const MapProjection& projection);

}  // namespace seastitch
