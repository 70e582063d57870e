#include "products/files/placed_soundings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "common/core/mounting.hpp"
#include "products/track/survey_lines.hpp"

namespace seastitch {
namespace {

// From the frame of a submap to north, east, depth.
class Placer {
 public:
  Placer(const SurveySubmap& submap, const Pose2& T_map_level, double shear_rad, MapAxes axes)
      : axes_(axes) {
    const Eigen::Isometry3d T_map_submap = SubmapPose(submap, T_map_level);
    linear_ = T_map_submap.linear() * LevelFromBody(submap.T_map_submap).transpose() *
              StraightFromBody(submap.T_map_submap, shear_rad);
    origin_ = T_map_submap.translation();
  }

  Eigen::Vector3d operator()(const Eigen::Vector3f& p_submap_m) const {
    return ToNorthEastDown(origin_ + linear_ * p_submap_m.cast<double>(), axes_);
  }

 private:
  MapAxes axes_;
  Eigen::Matrix3d linear_;
  Eigen::Vector3d origin_;
};

}  // namespace

void ForEachPlaced(const Survey& survey,
                   const SurveyPoses& poses,
                   MapAxes axes,
                   SoundingLog* log,
                   const std::function<void(const PlacedSoundings&)>& take) {
  std::map<SubmapId, std::size_t> place_of;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) place_of[survey.submaps[i].id] = i;
  std::vector<std::uint16_t> line_of(survey.submaps.size());
  const std::vector<SurveyLine> lines = LinesOf(survey);
  for (std::size_t n = 0; n < lines.size(); ++n)
    for (std::size_t i = lines[n].first; i <= lines[n].last; ++i)
      line_of[i] = static_cast<std::uint16_t>(n + 1);
  log->ForEach([&](const SubmapSoundings& submap, const std::vector<std::uint16_t>& inputs) {
    const auto found = place_of.find(submap.id);
    if (found == place_of.end()) return;
    const std::size_t i = found->second;
    const Placer place(survey.submaps[i], poses.T_map_level[i], poses.ShearOf(i), axes);
    PlacedSoundings placed{submap, inputs, {}, line_of[i]};
    placed.p_ned.reserve(submap.soundings.size());
    for (const SubmapSoundings::Sounding& s : submap.soundings)
      placed.p_ned.push_back(place(s.p_submap_m));
    take(placed);
  });
}

Raster Shoalest(const Survey& survey,
                const SurveyPoses& poses,
                const MapProjection& projection,
                const GridGeometry& geometry,
                SoundingLog* log) {
  Raster raster;
  raster.description = "elevation of the shallowest accepted sounding, positive up";
  raster.unit = "m";
  raster.is_vertical = true;
  raster.values.assign(geometry.size(), kNoData);
  ForEachPlaced(survey, poses, projection.axes(), log, [&](const PlacedSoundings& placed) {
    const std::vector<Eigen::Vector2d> north_east = projection.NorthEast(placed.p_ned);
    for (std::size_t k = 0; k < north_east.size(); ++k) {
      const int row = geometry.Row(north_east[k].x()), col = geometry.Col(north_east[k].y());
      if (!placed.submap.soundings[k].used || !geometry.Contains(row, col)) continue;
      float& cell = raster.values[geometry.Index(row, col)];
      cell = std::max(cell, static_cast<float>(-placed.p_ned[k].z()));
    }
  });
  return raster;
}

}  // namespace seastitch
