#include "products/report/survey_layers.hpp"

#include <Eigen/LU>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <variant>

#include "common/core/mounting.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

std::int64_t Count(std::uint64_t n) { return static_cast<std::int64_t>(n); }

class LayerMaker {
 public:
  LayerMaker(const Survey& survey, const SurveyPoses& poses, const MapProjection& projection)
      : survey_(survey), poses_(poses), projection_(projection) {
    for (std::size_t i = 0; i < survey.submaps.size(); ++i) place_of_[survey.submaps[i].id] = i;
  }

  VectorLayer Tracks(const std::vector<CorrectedState>& track, bool corrected) const {
    VectorLayer layer{corrected ? kTrackLayer : kTrackAsNavigatedLayer, VectorShape::kLines, {}};
    for (const std::vector<CorrectedState>& dive : TracksOfDives(track)) {
      if (dive.size() < 2) continue;
      std::vector<Eigen::Vector3d> points;
      for (const CorrectedState& s : dive)
        points.push_back(
            At(corrected ? s.corrected.Translation() : s.p_dead_reckoned.head<2>().eval(),
               s.p_dead_reckoned.z()));
      VectorFeature line;
      line.north_east = projection_.NorthEast(points);
      line.fields = {{"dive", DiveName(dive.front().chain)},
                     {"start", dive.front().time},
                     {"end", dive.back().time},
                     {"length_m", TrackLength(dive)},
                     {"submaps", Count(survey_.Mapped(dive.front().chain))}};
      layer.features.push_back(std::move(line));
    }
    return layer;
  }

  VectorLayer Footprints() const {
    VectorLayer layer{kFootprintLayer, VectorShape::kPolygons, {}};
    for (std::size_t i = 0; i < survey_.submaps.size(); ++i) {
      const SurveySubmap& s = survey_.submaps[i];
      const Footprint& corners = s.footprint.size() >= 3 ? s.footprint : s.hull;
      if (corners.size() < 3) continue;
      VectorFeature area;
      for (const Eigen::Vector2d& p : corners)
        area.north_east.push_back(Projected(poses_.T_map_level[i] * p, i));
      area.fields = {{"submap", std::int64_t{s.id.value}},
                     {"dive", DiveName(s.chain)},
                     {"closed_by", std::string(ToString(s.trigger))},
                     {"start", s.start},
                     {"end", s.end},
                     {"soundings_read", Count(s.soundings_read)},
                     {"soundings_used", Count(s.soundings_used)},
                     {"points", Count(s.points)}};
      layer.features.push_back(std::move(area));
    }
    return layer;
  }

  VectorLayer Edges() const {
    VectorLayer layer{kEdgeLayer, VectorShape::kLines, {}};
    for (const LoopRow& row : LoopRows(survey_)) {
      const GraphEdge& e = *row.edge;
      const auto from = place_of_.find(e.from), to = place_of_.find(e.to);
      if (from == place_of_.end() || to == place_of_.end()) continue;
      VectorFeature line;
      for (const std::size_t i : {from->second, to->second})
        line.north_east.push_back(Projected(poses_.T_map_level[i].Translation(), i));
      const Eigen::Vector3d residual = e.verdict == LoopVerdict::kAccepted
                                           ? Residual(e, from->second, to->second)
                                           : Eigen::Vector3d::Constant(kUnknown);
      line.fields = {{"from_submap", std::int64_t{e.from.value}},
                     {"to_submap", std::int64_t{e.to.value}},
                     {"verdict", std::string(ToString(e.verdict))},
                     {"weight", row.weight},
                     {"residual_m", residual.head<2>().norm()},
                     {"residual_deg", Rad2Deg(residual.z())},
                     {"z_offset_m", e.z_offset_m},
                     {"rms_m", e.rms_m},
                     {"overlap_m2", e.overlap_m2}};
      layer.features.push_back(std::move(line));
    }
    return layer;
  }

  // Each at the place of the submap's frame that it asks for.
  VectorLayer Fixes() const {
    VectorLayer layer{kFixLayer, VectorShape::kPoints, {}};
    for (const GraphEdge& e : survey_.edges) {
      const auto at = place_of_.find(e.from);
      if (e.kind != EdgeKind::kPositionFix || at == place_of_.end()) continue;
      const std::size_t i = at->second;
      const Eigen::Vector2d sigma =
          e.information.topLeftCorner<2, 2>().inverse().diagonal().cwiseMax(0.0).cwiseSqrt();
      VectorFeature point;
      point.north_east = {Projected(e.T_from_to.Translation(), i)};
      point.fields = {
          {"submap", std::int64_t{e.from.value}},
          {"time", survey_.submaps[i].frame_time},
          {"sigma_north_m", sigma.x()},
          {"sigma_east_m", sigma.y()},
          {"residual_m", (poses_.VehicleAt(i).Translation() - e.T_from_to.Translation()).norm()}};
      layer.features.push_back(std::move(point));
    }
    return layer;
  }

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::string DiveName(std::int32_t chain) const {
    const auto k = static_cast<std::size_t>(chain);
    return k < survey_.dives.size() ? survey_.dives[k] : std::string();
  }

  Eigen::Vector3d At(const Eigen::Vector2d& p_map, double z_map) const {
    return ToNorthEastDown({p_map.x(), p_map.y(), z_map}, projection_.axes());
  }
  // A point of the map at the depth of submap i.
  Eigen::Vector2d Projected(const Eigen::Vector2d& p_map, std::size_t i) const {
    return projection_.NorthEast(At(p_map, survey_.submaps[i].T_map_submap.translation().z()));
  }

  // Relative pose of the map less that of the closure, axes of `from`: x, y [m], yaw [rad].
  Eigen::Vector3d Residual(const GraphEdge& e, std::size_t from, std::size_t to) const {
    const bool one_dive = survey_.submaps[from].chain == survey_.submaps[to].chain;
    const EdgeByMounting by = ByMounting(e, one_dive);
    const Eigen::Vector3d measured =
        MeasuredBy(survey_.NewestDvlYaw(survey_.submaps[to].chain), e, by).Vector() +
        MountingCorrection(by, poses_.MountingOf(from), poses_.MountingOf(to));
    const Pose2 T_from_to = Inverse(poses_.T_map_level[from]) * poses_.T_map_level[to];
    Eigen::Vector3d residual = T_from_to.Vector() - measured;
    residual.z() = WrapAngle(residual.z());
    return residual;
  }

  const Survey& survey_;
  const SurveyPoses& poses_;
  const MapProjection& projection_;
  std::map<SubmapId, std::size_t> place_of_;
};

template <class T>
T FieldOf(const VectorFeature& feature, const std::string& name, const T& missing) {
  for (const auto& [field, value] : feature.fields)
    if (field == name)
      if (const T* const held = std::get_if<T>(&value)) return *held;
  return missing;
}

}  // namespace

MapLines LinesOf(const std::vector<VectorLayer>& layers) {
  MapLines lines;
  for (const VectorLayer& layer : layers)
    for (const VectorFeature& feature : layer.features) {
      if (layer.name == kTrackLayer) lines.track.push_back(feature.north_east);
      if (layer.name == kTrackAsNavigatedLayer)
        lines.track_as_navigated.push_back(feature.north_east);
      if (layer.name == kEdgeLayer)
        lines.closures.push_back(
            {feature.north_east, FieldOf<double>(feature, "weight", 0.0) >= kAcceptedWeight});
      if (layer.name == kFootprintLayer)
        lines.submaps.push_back({FieldOf<std::int64_t>(feature, "submap", -1), feature.north_east});
    }
  return lines;
}

std::vector<VectorLayer> SurveyLayers(const Survey& survey,
                                      const SurveyPoses& poses,
                                      const std::vector<CorrectedState>& track,
                                      const MapProjection& projection) {
  const LayerMaker maker(survey, poses, projection);
  return {maker.Tracks(track, true),
          maker.Tracks(track, false),
          maker.Footprints(),
          maker.Edges(),
          maker.Fixes()};
}

}  // namespace seastitch
