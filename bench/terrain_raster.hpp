#pragma once

#include <memory>
#include <string>

#include "bench/terrain.hpp"

namespace seastitch::bench {

struct RasterParams {
  std::string file;             // empty: none
  bool positive_down = false;   // false: elevations, negative below the datum
  double depth_offset_m = 0.0;  // added to every depth: tide, or water to dive in
  double fill_m = 4.0;          // holes up to so far from known cells are filled
  bool overlay = false;         // the procedural relief, waves and pipeline stand on it
};

// Any raster that GDAL reads, first band, with the survey laid where it covers the most known
// cells. The map's north is the raster's up. Throws std::runtime_error "FILE: reason": not a
// raster, not in metres (geographic coordinates are not), rotated, too large, or without a known
// cell.
std::unique_ptr<GridTerrain> LoadRaster(const RasterParams& params, const MapBox& survey);

}  // namespace seastitch::bench
