#include "products/survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace seastitch {
namespace {

std::map<SubmapId, const SolvedVertex*> UsableVertices(const PoseGraph& graph) {
  std::map<SubmapId, const SolvedVertex*> usable;
  for (const SolvedVertex& v : graph.vertices) {
    if (v.T_map_level.Vector().allFinite()) usable[v.id] = &v;
  }
  return usable;
}

}  // namespace

TrackState ToTrackState(const NavState& state, std::int32_t chain) {
  const auto variance = state.covariance.diagonal();
  return {state.time,
          state.T_map_vehicle.translation(),
          RpyFromRotation(state.T_map_vehicle.linear()),
          Eigen::Vector3d(variance(0), variance(1), variance(5)).cwiseMax(0).cwiseSqrt(),
          chain};
}

Time Survey::End() const {
  Time end;
  for (const SurveySubmap& submap : submaps)
    if (HasSoundings(submap.trigger)) end = std::max(end, submap.end);
  return end;
}

std::size_t Survey::Mapped(std::optional<std::int32_t> chain) const {
  return static_cast<std::size_t>(
      std::count_if(submaps.begin(), submaps.end(), [chain](const SurveySubmap& submap) {
        return HasSoundings(submap.trigger) && submap.chain == chain.value_or(submap.chain);
      }));
}

std::string Survey::InputAt(Time time) const {
  const SurveyInput* found = nullptr;
  for (const SurveyInput& input : inputs) {
    if (time < input.first || time > input.last) continue;
    if (found == nullptr || input.last - input.first < found->last - found->first) found = &input;
  }
  return found == nullptr ? std::string() : found->name;
}

double Survey::NewestDvlYaw(std::int32_t chain) const {
  const auto newest = std::find_if(
      submaps.rbegin(), submaps.rend(), [&](const SurveySubmap& s) { return s.chain == chain; });
  return newest == submaps.rend() ? 0.0 : newest->dvl_yaw_rad;
}

SurveyPoses DeadReckonedPoses(const Survey& survey) {
  SurveyPoses poses;
  for (const SurveySubmap& s : survey.submaps)
    poses.T_map_level.push_back(LevelPose(s.T_map_submap));
  return poses;
}

SurveyPoses SolvedPoses(const Survey& survey) {
  const auto solved = UsableVertices(survey.solution);
  const std::vector<Pose2> dead_reckoned = DeadReckonedPoses(survey).T_map_level;
  std::vector<Pose2> poses = dead_reckoned;
  std::vector<MountingErrors> of_submaps;
  std::vector<double> learnt_yaw_rad(poses.size(), 0.0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SurveySubmap& submap = survey.submaps[i];
    const MountingErrors& mounting =
        of_submaps.emplace_back(survey.solution.MountingOf(submap.chain));
    learnt_yaw_rad[i] = survey.NewestDvlYaw(submap.chain) - submap.dvl_yaw_rad;
    const auto it = solved.find(survey.submaps[i].id);
    if (it != solved.end()) {
      poses[i] = it->second->T_map_level;
    } else if (i > 0 && survey.submaps[i].chain == survey.submaps[i - 1].chain) {
      const Pose2 step = TravelledPose(Inverse(dead_reckoned[i - 1]) * dead_reckoned[i], mounting);
      poses[i] = SoundingPose(VehiclePose(poses[i - 1], mounting) * step, mounting);
    } else {
      poses[i] = SoundingPose(poses[i], mounting);
    }
  }
  return {std::move(poses), std::move(of_submaps), std::move(learnt_yaw_rad)};
}

std::vector<std::optional<Eigen::Vector3d>> SolvedSigmas(const Survey& survey) {
  const auto solved = UsableVertices(survey.solution);
  std::vector<std::optional<Eigen::Vector3d>> sigmas(survey.submaps.size());
  for (std::size_t i = 0; i < sigmas.size(); ++i) {
    const auto it = solved.find(survey.submaps[i].id);
    if (it == solved.end()) continue;
    const Eigen::Vector3d variance = it->second->covariance.diagonal();
    if (variance.allFinite() && (variance.array() >= 0.0).all()) {
      sigmas[i] = variance.cwiseSqrt();
    }
  }
  return sigmas;
}

std::vector<LoopRow> LoopRows(const Survey& survey) {
  std::map<std::pair<SubmapId, SubmapId>, double> weights;
  for (const SolvedEdge& e : survey.solution.loop_edges) weights[{e.from, e.to}] = e.weight;
  std::vector<LoopRow> rows;
  for (const GraphEdge& e : survey.edges) {
    if (e.kind != EdgeKind::kLoopClosure) continue;
    const auto it = weights.find({e.from, e.to});
    const bool solved = e.verdict == LoopVerdict::kAccepted && it != weights.end();
    rows.push_back({&e, solved ? it->second : std::numeric_limits<double>::quiet_NaN()});
  }
  return rows;
}

Eigen::Isometry3d SubmapPose(const SurveySubmap& submap, const Pose2& T_map_level) {
  return WithLevelPose(submap.T_map_submap, T_map_level);
}

}  // namespace seastitch
