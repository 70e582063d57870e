#pragma once

#include <memory>
#include <string>

#include "bench/terrain.hpp"

namespace seastitch::bench {

struct RasterParams {
  std::string file;             // empty: none
  bool positive_down = false;   // false: elevations, negative below the datum
  double depth_offset_m = 0.0;  // added to every depth: tide, or additional water
  double fill_m = 4.0;          // largest distance from known cells up to which holes are filled
  bool overlay = false;         // adds the procedural relief, waves and pipeline
};

// Loads the first band of a raster that GDAL reads, with the survey placed where it covers most
// known cells. The map's north is the raster's up. Throws std::runtime_error "FILE: reason" if it
// is not a raster, not in metres (geographic coordinates are not), rotated, too large, or without a
// known cell below the water.
std::unique_ptr<GridTerrain> LoadRaster(const RasterParams& params, const MapBox& survey);

}  // namespace seastitch::bench
