#pragma once

#include <vector>

#include "products/geo/geo_package.hpp"
#include "products/survey.hpp"
#include "products/track/track.hpp"
#include "viewer/map_data.hpp"

namespace seastitch {

// Names of the layers of survey.gpkg.
inline constexpr char kTrackLayer[] = "track";
inline constexpr char kTrackAsNavigatedLayer[] = "track_as_navigated";
inline constexpr char kFootprintLayer[] = "footprints";
inline constexpr char kEdgeLayer[] = "edges";
inline constexpr char kFixLayer[] = "fixes";

// Layers of a survey for a GIS: the track of each dive, corrected and as navigated; the footprints
// of its submaps; every registration, with its residual at `poses` where it is a loop closure; and
// the position fixes that the graph has.
std::vector<VectorLayer> SurveyLayers(const Survey& survey,
                                      const SurveyPoses& poses,
                                      const std::vector<CorrectedState>& track,
                                      const MapProjection& projection);

// The same for the map of report.html.
MapLines LinesOf(const std::vector<VectorLayer>& layers);

}  // namespace seastitch
