#pragma once

#include <vector>

#include "products/files/geo_files.hpp"
#include "products/map/map_points.hpp"
#include "products/report/picture.hpp"
#include "products/survey.hpp"
#include "products/track/track.hpp"

// Track, footprints and loop closures of a survey, for pictures and for GIS layers.
namespace seastitch {

// One line per dive.
std::vector<PictureLine> TrackLines(const std::vector<CorrectedState>& track,
                                    bool corrected,
                                    MapAxes axes);

// One line per accepted loop closure, between the frames of its submaps; paler for a smaller inlier
// weight.
std::vector<PictureLine> LoopLines(const Survey& survey,
                                   const std::vector<Pose2>& T_map_level,
                                   MapAxes axes);

// Layers "track" (corrected and dead reckoned), "footprints" and "edges" (every registration).
std::vector<VectorLayer> SurveyLayers(const Survey& survey,
                                      const std::vector<Pose2>& T_map_level,
                                      const std::vector<CorrectedState>& track,
                                      MapAxes axes);

}  // namespace seastitch
