#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/grid.hpp"
#include "common/core/time.hpp"
#include "products/geo/map_projection.hpp"

// Rasters as the bytes of a file. Grid rows run north and columns east, rasters have north up.
namespace seastitch {

constexpr float kNoData = -9999.0f;

enum class RasterType : std::uint8_t { kFloat, kCount };

struct Raster {
  std::string description;
  std::string unit;           // "m" or empty
  std::vector<float> values;  // in the grid's order; kNoData: no value
  // kCount: written as unsigned integers of 32 bits, 0 where there is no value.
  RasterType type = RasterType::kFloat;
  bool is_vertical = false;  // the values are elevations: the CRS states the vertical system too
};

// A cloud-optimised GeoTIFF of one band, with its statistics and, where it is large, overviews. It
// has no creation time, so that the same map gives the same bytes. Throws std::runtime_error with
// GDAL's reason.
std::string GeoTiff(const GridGeometry& geometry,
                    const Raster& raster,
                    const MapProjection& projection);

// A Bathymetric Attributed Grid (BAG, Open Navigation Surface): elevation and its uncertainty,
// 1 sigma, for a map with a CRS. Its date is the end of the survey.
struct BagContent {
  const Raster& elevation;
  const Raster& uncertainty;
  std::string title;
  Time end;  // of the survey
};
std::string Bag(const GridGeometry& geometry,
                const BagContent& content,
                const MapProjection& projection);

}  // namespace seastitch
