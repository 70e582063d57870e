#include "products/report/survey_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "common/core/median.hpp"

namespace seastitch {
namespace {

constexpr Rgb kTrackColour{0.10, 0.10, 0.12};
constexpr Rgb kLoopColour{0.86, 0.12, 0.36};

std::map<SubmapId, Eigen::Vector2d> FramePositions(const Survey& survey,
                                                   const SurveyPoses& poses,
                                                   const MapProjection& projection) {
  std::vector<Eigen::Vector3d> frames;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i)
    frames.push_back(ToNorthEastDown(
        SubmapPose(survey.submaps[i], poses.T_map_level[i]).translation(), projection.axes()));
  const std::vector<Eigen::Vector2d> north_east = projection.NorthEast(frames);
  std::map<SubmapId, Eigen::Vector2d> positions;
  for (std::size_t i = 0; i < frames.size(); ++i) positions[survey.submaps[i].id] = north_east[i];
  return positions;
}

}  // namespace

std::vector<PictureLine> TrackLines(const std::vector<CorrectedState>& track,
                                    bool corrected,
                                    const MapProjection& projection) {
  std::vector<PictureLine> lines;
  for (const std::vector<CorrectedState>& dive : TracksOfDives(track)) {
    std::vector<Eigen::Vector3d> points;
    for (const CorrectedState& s : dive) {
      const Eigen::Vector2d at =
          corrected ? s.corrected.Translation() : s.p_dead_reckoned.head<2>().eval();
      points.push_back(ToNorthEastDown({at.x(), at.y(), s.p_dead_reckoned.z()}, projection.axes()));
    }
    PictureLine line;
    line.colour = kTrackColour;
    line.width_px = 1.2;
    line.opacity = 0.75;
    line.legend = corrected ? "track, corrected" : "track, as navigated";
    line.north_east = projection.NorthEast(points);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<PictureLine> LoopLines(const Survey& survey,
                                   const SurveyPoses& poses,
                                   const MapProjection& projection) {
  const auto at = FramePositions(survey, poses, projection);
  std::vector<PictureLine> lines;
  for (const LoopRow& row : LoopRows(survey)) {
    const GraphEdge& e = *row.edge;
    if (e.verdict != LoopVerdict::kAccepted || !at.contains(e.from) || !at.contains(e.to)) continue;
    PictureLine line;
    line.colour = kLoopColour;
    line.opacity = std::isfinite(row.weight) ? 0.25 + 0.65 * std::clamp(row.weight, 0.0, 1.0) : 0.9;
    line.legend = "loop closures";
    line.north_east = {at.at(e.from), at.at(e.to)};
    lines.push_back(std::move(line));
  }
  return lines;
}

ColourRange RangeOf(const std::vector<const std::vector<float>*>& rasters,
                    double lo,
                    double hi,
                    double width) {
  std::vector<float> values;
  for (const std::vector<float>* raster : rasters) {
    std::copy_if(raster->begin(), raster->end(), std::back_inserter(values), [](float v) {
      return v != kNoData;
    });
  }
  ColourRange range{0.0, 1.0};
  if (!values.empty()) {
    const auto index = [&](double share) {
      return static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)));
    };
    range = OrderStatistics(index(lo), index(hi), &values);
  }
  if (range.second - range.first >= width) return range;
  const double middle = 0.5 * (range.first + range.second);
  return {middle - 0.5 * width, middle + 0.5 * width};
}

Picture DepthPicture(const GridGeometry& geometry,
                     const std::vector<float>& elevation_m,
                     const ColourRange& depth_m) {
  Picture picture;
  picture.geometry = geometry;
  picture.values = elevation_m;
  for (float& value : picture.values)
    if (value != kNoData) value = -value;
  picture.lowest = depth_m.first;
  picture.highest = depth_m.second;
  picture.value_label = "Depth (m)";
  picture.deeper_is_down = true;
  picture.hill_shade = true;
  picture.colours = &DepthColours();
  return picture;
}

Picture MismatchPicture(const GridGeometry& geometry,
                        const std::vector<float>& mismatch_m,
                        const std::vector<float>& seen,
                        double highest_m) {
  Picture picture;
  picture.geometry = geometry;
  picture.values = mismatch_m;
  picture.underlay = seen;
  picture.highest = highest_m;
  picture.value_label = "Swath mismatch (m)";
  picture.colours = &ConsistencyColours();
  return picture;
}

}  // namespace seastitch
