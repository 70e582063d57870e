#include "products/files/graph_files.hpp"

#include <cstdio>
#include <map>

namespace seastitch {
namespace {

void Append(std::string* out, double value) {
  char text[40];
  std::snprintf(text, sizeof text, " %.17g", value);
  *out += text;
}

void Append(std::string* out, const Pose2& pose) {
  Append(out, pose.x);
  Append(out, pose.y);
  Append(out, pose.yaw);
}

// correction: of the mounting errors, so that the file agrees with itself.
void AppendEdge(std::string* out, const GraphEdge& edge, const Eigen::Vector3d& correction) {
  if (edge.from == edge.to) {
    *out += "EDGE_PRIOR_SE2 " + std::to_string(edge.from.value);
  } else {
    *out += "EDGE_SE2 " + std::to_string(edge.from.value) + " " + std::to_string(edge.to.value);
  }
  const Eigen::Vector3d T = edge.T_from_to.Vector() + correction;
  Append(out, Pose2{T.x(), T.y(), T.z()});
  for (int row = 0; row < 3; ++row) {
    for (int col = row; col < 3; ++col) Append(out, edge.information(row, col));
  }
  *out += '\n';
}

}  // namespace

std::string PosesTxt(const Survey& survey, const std::vector<Pose2>& T_map_level) {
  std::string out;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    if (!HasSoundings(survey.submaps[i].trigger)) continue;
    const Eigen::Isometry3d T = SubmapPose(survey.submaps[i], T_map_level[i]);
    Eigen::Quaterniond q(T.linear());
    q.normalize();
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    out += std::to_string(survey.submaps[i].id.value);
    for (const double v : {T.translation().x(), T.translation().y(), T.translation().z()}) {
      Append(&out, v);
    }
    for (const double v : {q.x(), q.y(), q.z(), q.w()}) Append(&out, v);
    out += '\n';
  }
  return out;
}

std::string GraphG2o(const Survey& survey, const SurveyPoses& poses) {
  std::string out;
  std::map<SubmapId, std::size_t> place_of;
  for (std::size_t i = 0; i < survey.submaps.size(); ++i) {
    const SubmapId id = survey.submaps[i].id;
    place_of[id] = i;
    out += "VERTEX_SE2 " + std::to_string(id.value);
    Append(&out, poses.T_map_level[i]);
    out += '\n';
    if (i == 0) out += "FIX " + std::to_string(id.value) + "\n";
  }
  for (const GraphEdge& edge : survey.edges) {
    const auto from = place_of.find(edge.from), to = place_of.find(edge.to);
    if (edge.verdict != LoopVerdict::kAccepted || from == place_of.end() || to == place_of.end())
      continue;
    const std::size_t i = from->second, j = to->second;
    const bool of_one_dive = survey.submaps[i].chain == survey.submaps[j].chain;
    const EdgeByMounting by = ByMounting(edge, of_one_dive);
    GraphEdge by_now = edge;
    by_now.T_from_to = MeasuredBy(survey.NewestDvlYaw(survey.submaps[j].chain), edge, by);
    AppendEdge(&out, by_now, MountingCorrection(by, poses.MountingOf(i), poses.MountingOf(j)));
  }
  return out;
}

}  // namespace seastitch
