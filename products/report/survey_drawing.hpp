#pragma once

#include <utility>
#include <vector>

#include "products/geo/raster.hpp"
#include "products/report/picture.hpp"
#include "products/survey.hpp"
#include "products/track/track.hpp"

// Pictures of a survey's maps, and the lines on them.
namespace seastitch {

// One line per dive.
std::vector<PictureLine> TrackLines(const std::vector<CorrectedState>& track,
                                    bool corrected,
                                    const MapProjection& projection);

// One line per accepted loop closure, between the frames of its submaps; paler for a smaller inlier
// weight.
std::vector<PictureLine> LoopLines(const Survey& survey,
                                   const SurveyPoses& poses,
                                   const MapProjection& projection);

// Lowest and highest value of a colour scale.
using ColourRange = std::pair<double, double>;

// The values below which the shares lo and hi of all cells lie, widened to at least `width`.
ColourRange RangeOf(const std::vector<const std::vector<float>*>& rasters,
                    double lo,
                    double hi,
                    double width);

// A map of elevations, shown as depths.
Picture DepthPicture(const GridGeometry& geometry,
                     const std::vector<float>& elevation_m,
                     const ColourRange& depth_m);

// A map of the swath mismatch. seen: cells with a value of it are grey where there is none of the
// mismatch.
Picture MismatchPicture(const GridGeometry& geometry,
                        const std::vector<float>& mismatch_m,
                        const std::vector<float>& seen,
                        double highest_m);

}  // namespace seastitch
