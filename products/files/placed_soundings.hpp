#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/grid.hpp"
#include "products/files/sounding_log.hpp"
#include "products/geo/raster.hpp"
#include "products/survey.hpp"

namespace seastitch {

// The soundings of one submap at their final positions.
struct PlacedSoundings {
  const SubmapSoundings& submap;
  const std::vector<std::uint16_t>& inputs;  // of each ping: index of its file in Survey::inputs
  std::vector<Eigen::Vector3d> p_ned;        // map frame, in the order of submap.soundings
  std::uint16_t line = 0;                    // number of LinesCsv()
};

// Calls take for every submap of the log that the survey has.
void ForEachPlaced(const Survey& survey,
                   const SurveyPoses& poses,
                   MapAxes axes,
                   SoundingLog* log,
                   const std::function<void(const PlacedSoundings&)>& take);

// Elevation of the shallowest used sounding of each cell.
Raster Shoalest(const Survey& survey,
                const SurveyPoses& poses,
                const MapProjection& projection,
                const GridGeometry& geometry,
                SoundingLog* log);

}  // namespace seastitch
