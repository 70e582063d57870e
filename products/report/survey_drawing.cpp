#include "products/report/survey_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace seastitch {
namespace {

constexpr Rgb kTrackColour{0.10, 0.10, 0.12};
constexpr Rgb kLoopColour{0.86, 0.12, 0.36};

std::map<SubmapId, Eigen::Vector2d> FramePositions(const Survey& survey,
                                                   const std::vector<Pose2>& poses,
                                                   MapAxes axes) {
  std::map<SubmapId, Eigen::Vector2d> positions;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    positions[survey.submaps[i].id] = ToNorthEast(poses[i].Translation(), axes);
  }
  return positions;
}

}  // namespace

std::vector<PictureLine> TrackLines(const std::vector<CorrectedState>& track,
                                    bool corrected,
                                    MapAxes axes) {
  std::vector<PictureLine> lines;
  for (std::size_t i = 0; i < track.size(); ++i) {
    if (i == 0 || track[i].chain != track[i - 1].chain) {
      PictureLine line;
      line.colour = kTrackColour;
      line.width_px = 1.2;
      line.opacity = 0.75;
      line.legend = corrected ? "track, corrected" : "track, dead reckoned";
      lines.push_back(std::move(line));
    }
    const CorrectedState& s = track[i];
    lines.back().north_east.push_back(ToNorthEast(
        corrected ? s.corrected.Translation() : Eigen::Vector2d(s.p_dead_reckoned.head<2>()),
        axes));
  }
  return lines;
}

std::vector<PictureLine> LoopLines(const Survey& survey,
                                   const std::vector<Pose2>& poses,
                                   MapAxes axes) {
  const auto at = FramePositions(survey, poses, axes);
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

std::vector<VectorLayer> SurveyLayers(const Survey& survey,
                                      const std::vector<Pose2>& poses,
                                      const std::vector<CorrectedState>& track,
                                      MapAxes axes) {
  VectorLayer tracks{"track", false, {}};
  for (const bool corrected : {true, false}) {
    for (PictureLine& of_chain : TrackLines(track, corrected, axes)) {
      VectorFeature line;
      line.north_east = std::move(of_chain.north_east);
      line.fields = {{"kind", std::string(corrected ? "corrected" : "dead reckoned")}};
      if (line.north_east.size() > 1) tracks.features.push_back(std::move(line));
    }
  }
  VectorLayer footprints{"footprints", true, {}};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SurveySubmap& s = survey.submaps[i];
    const Footprint& corners = s.footprint.size() >= 3 ? s.footprint : s.hull;
    if (corners.size() < 3) continue;
    VectorFeature area;
    for (const Eigen::Vector2d& p : corners) {
      area.north_east.push_back(ToNorthEast(poses[i] * p, axes));
    }
    area.fields = {{"submap", static_cast<double>(s.id.value)},
                   {"closed_by", std::string(ToString(s.trigger))},
                   {"start_utime_us", static_cast<double>(ToUtime(s.start))},
                   {"end_utime_us", static_cast<double>(ToUtime(s.end))},
                   {"soundings_read", static_cast<double>(s.soundings_read)},
                   {"soundings_used", static_cast<double>(s.soundings_used)},
                   {"points", static_cast<double>(s.points)}};
    footprints.features.push_back(std::move(area));
  }
  VectorLayer edges{"edges", false, {}};
  const auto at = FramePositions(survey, poses, axes);
  for (const LoopRow& row : LoopRows(survey)) {
    const GraphEdge& e = *row.edge;
    if (!at.contains(e.from) || !at.contains(e.to)) continue;
    VectorFeature line;
    line.north_east = {at.at(e.from), at.at(e.to)};
    line.fields = {{"from_submap", static_cast<double>(e.from.value)},
                   {"to_submap", static_cast<double>(e.to.value)},
                   {"verdict", std::string(ToString(e.verdict))},
                   {"weight", row.weight},
                   {"z_offset_m", e.z_offset_m},
                   {"rms_m", e.rms_m},
                   {"overlap_m2", e.overlap_m2}};
    edges.features.push_back(std::move(line));
  }
  return {std::move(tracks), std::move(footprints), std::move(edges)};
}

}  // namespace seastitch
