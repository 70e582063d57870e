#include "products/survey_collector.hpp"

#include <boost/geometry/algorithms/convex_hull.hpp>
#include <boost/geometry/geometries/multi_point.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <boost/geometry/strategies/strategies.hpp>
#include <cmath>
#include <map>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/storage/submap_file.hpp"
#include "products/track/track.hpp"

namespace seastitch {
namespace {

namespace bg = boost::geometry;

// Corners of the convex hull of the cloud in the level frame, not closed.
Footprint LevelHull(const PointCloud& cloud, const Eigen::Isometry3d& T_map_submap) {
  using Point = bg::model::d2::point_xy<double>;
  const Eigen::Matrix3d R_level_body = LevelFromBody(T_map_submap);
  bg::model::multi_point<Point> points;
  points.reserve(cloud.size());
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d p_level = R_level_body * p.cast<double>();
    points.emplace_back(p_level.x(), p_level.y());
  }
  bg::model::polygon<Point, true, false> hull;
  bg::convex_hull(points, hull);
  Footprint corners;
  for (const Point& p : hull.outer()) corners.emplace_back(p.x(), p.y());
  return corners;
}

PointCloud FinitePoints(const PointCloud& cloud) {
  PointCloud finite;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float n = i < cloud.soundings.size() ? cloud.soundings[i] : 1.0f;
    if (cloud.points[i].allFinite()) {
      finite.Add(cloud.points[i], std::isfinite(n) && n > 0.0f ? n : 1.0f);
    }
  }
  return finite;
}

}  // namespace

std::string SurveyCollectorOptions::Validate() const {
  if (!(track_interval_s >= 0.0)) {
    return "track_interval_s = " + std::to_string(track_interval_s) + ", must be >= 0";
  }
  return {};
}

SurveyCollector::SurveyCollector(std::filesystem::path dir, SurveyCollectorOptions options)
    : submap_dir_(std::move(dir) / "submaps"), options_(std::move(options)) {
  if (const std::string wrong = options_.Validate(); !wrong.empty()) {
    throw std::runtime_error("survey collector: " + wrong);
  }
  std::error_code error;
  std::filesystem::create_directories(submap_dir_, error);
  if (error) throw std::runtime_error(submap_dir_.string() + ": " + error.message());
}

void SurveyCollector::BeginDive(const std::string& name) { dives_.push_back(name); }

void SurveyCollector::Add(const Submap& submap) {
  if (!submap.T_map_submap.matrix().allFinite()) {
    ++counters_["submap_pose_not_finite"];
    return;
  }
  if (submaps_.contains(submap.id)) {
    ++counters_["submap_repeated"];
    return;
  }
  PointCloud cloud = FinitePoints(submap.cloud);
  if (cloud.size() != submap.cloud.size()) {
    counters_["submap_points_not_finite"] += submap.cloud.size() - cloud.size();
  }
  SurveySubmap kept;
  kept.id = submap.id;
  kept.start = submap.start;
  kept.end = submap.end;
  kept.frame_time = submap.frame_time;
  kept.T_map_submap = submap.T_map_submap;
  kept.trigger = submap.trigger;
  kept.soundings_read = submap.soundings_read;
  kept.soundings_used = submap.soundings_used;
  kept.points = cloud.size();
  kept.footprint = submap.footprint;
  kept.dvl_yaw_rad = submap.dvl_yaw_rad;
  const bool is_empty = cloud.empty();
  if (is_empty && HasSoundings(submap.trigger)) ++counters_["submap_without_points"];
  if (!is_empty)
    kept.cloud_file = submap_dir_ / ("submap_" + std::to_string(submap.id.value) + ".pcd");
  SurveySubmap& in_survey = submaps_.emplace(submap.id, std::move(kept)).first->second;
  if (!is_empty) clouds_.Add({&in_survey, std::move(cloud)});
}

void SurveyCollector::Write(const Unwritten& submap) {
  submap.kept->hull = LevelHull(submap.cloud, submap.kept->T_map_submap);
  WriteSubmapPcd(submap.kept->cloud_file, submap.cloud, submap.kept->T_map_submap);
}

void SurveyCollector::Add(const NavState& state) {
  if (!state.T_map_vehicle.matrix().allFinite()) {
    ++counters_["nav_not_finite"];
    return;
  }
  Add(ToTrackState(state, 0));
}

std::int32_t SurveyCollector::Chain() const {
  return static_cast<std::int32_t>(dives_.empty() ? 0 : dives_.size() - 1);
}

void SurveyCollector::Add(const SmoothedPose& pose) {
  std::vector<SmoothedPose>& of_dive = smoothed_[Chain()];
  if (pose.smoothed.Vector().allFinite() && (of_dive.empty() || of_dive.back().time < pose.time))
    of_dive.push_back(pose);
}

void SurveyCollector::Add(TrackState state) {
  state.chain = Chain();
  if (!track_.empty() && track_.back().chain == state.chain) {
    if (state.time <= track_.back().time) return AddEarlier(state);
    earlier_.clear();
    if (ToSeconds(state.time - track_.back().time) < options_.track_interval_s) return;
  }
  track_.push_back(state);
}

// Navigation that begins again, since the inertial unit's clock was wrong, goes on at an earlier
// time: the states before are by the wrong clock. A few stray states are only counted.
void SurveyCollector::AddEarlier(const TrackState& state) {
  constexpr std::size_t kBegunAgain = 20;
  ++counters_["nav_out_of_order"];
  if (!earlier_.empty() && state.time <= earlier_.back().time) earlier_.clear();
  earlier_.push_back(state);
  if (earlier_.size() < kBegunAgain) return;
  std::erase_if(track_, [&](const TrackState& s) { return s.chain == state.chain; });
  track_.insert(track_.end(), earlier_.begin(), earlier_.end());
  earlier_.clear();
  published_.clear();
  smoothed_.erase(state.chain);
}

void SurveyCollector::Add(const CorrectedNavState& corrected) {
  const Pose2 pose = LevelPose(corrected.state.T_map_vehicle);
  const Pose2 nav = Inverse(corrected.T_map_nav) * pose;
  if (!pose.Vector().allFinite() || !nav.Vector().allFinite()) {
    ++counters_["nav_corrected_not_finite"];
    return;
  }
  if (!published_.empty()) {
    if (corrected.state.time <= published_.back().time) {
      ++counters_["nav_corrected_out_of_order"];
      return;
    }
    if (ToSeconds(corrected.state.time - published_.back().time) < options_.track_interval_s)
      return;
  }
  published_.push_back({corrected.state.time, nav, pose});
}

void SurveyCollector::Add(const GraphUpdate& update) {
  for (const GraphVertex& vertex : update.vertices) chains_[vertex.id] = vertex.chain;
  const bool is_new = edges_by_version_.emplace(update.version, update.edges).second;
  if (!is_new) ++counters_["graph_update_repeated"];
}

void SurveyCollector::Add(const PoseGraph& graph) {
  if (graph.graph_version >= solution_.graph_version) {
    solution_ = graph;
  } else {
    ++counters_["pose_graph_older"];
  }
}

Survey SurveyCollector::Finish() {
  clouds_.Finish();
  Survey survey;
  for (const auto& [id, submap] : submaps_) {
    survey.submaps.push_back(submap);
    if (const auto found = chains_.find(id); found != chains_.end())
      survey.submaps.back().chain = found->second;
  }
  survey.dives = dives_;
  survey.track = track_;
  for (const auto& [chain, poses] : smoothed_) Smooth(poses, chain, &survey.track);
  survey.published = published_;
  // A pair that was registered again counts with its last verdict.
  std::map<std::pair<SubmapId, SubmapId>, std::size_t> place_of_closure;
  for (const auto& [version, edges] : edges_by_version_) {
    for (const GraphEdge& edge : edges) {
      const std::size_t next = survey.edges.size();
      const std::size_t place =
          edge.kind == EdgeKind::kLoopClosure
              ? place_of_closure.try_emplace({edge.from, edge.to}, next).first->second
              : next;
      if (place == next) survey.edges.emplace_back();
      survey.edges[place] = edge;
    }
  }
  survey.solution = solution_;
  survey.counters = counters_;
  return survey;
}

}  // namespace seastitch
