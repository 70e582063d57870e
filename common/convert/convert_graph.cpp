#include <algorithm>
#include <utility>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"

namespace seastitch {
namespace {

using namespace convert;  // the checks

// One part stays under 60 kB (pose_graph_t.lcm).
constexpr std::size_t kVerticesPerPart = 250;
constexpr std::size_t kEdgesPerPart = 500;
constexpr std::size_t kMountingsPerPart = 50;

std::size_t PartsFor(std::size_t count, std::size_t per_part) {
  return (count + per_part - 1) / per_part;
}

// Elements [part * n, part * n + n) of a list.
template <class T>
std::vector<T> PartOf(const std::vector<T>& list, std::size_t part, std::size_t n) {
  const auto begin = static_cast<std::ptrdiff_t>(std::min(list.size(), part * n));
  const auto end = static_cast<std::ptrdiff_t>(std::min(list.size(), part * n + n));
  return std::vector<T>(list.begin() + begin, list.begin() + end);
}

graph_vertex_t ToLcm(const GraphVertex& vertex) {
  graph_vertex_t msg{};
  msg.utime = ToUtime(vertex.time);
  msg.id = vertex.id.value;
  msg.dead_reckoned_x_m = vertex.dead_reckoned.x;
  msg.dead_reckoned_y_m = vertex.dead_reckoned.y;
  msg.dead_reckoned_yaw_rad = vertex.dead_reckoned.yaw;
  msg.has_heading_sigma = vertex.heading_sigma_rad.has_value();
  msg.heading_sigma_rad = vertex.heading_sigma_rad.value_or(0.0);
  msg.chain = vertex.chain;
  return msg;
}

// The sigma is there without its flag where it is not finite: then the message is damaged.
GraphVertex FromLcm(const graph_vertex_t& msg) {
  GraphVertex vertex{SubmapId{msg.id},
                     FromUtime(msg.utime),
                     {msg.dead_reckoned_x_m, msg.dead_reckoned_y_m, msg.dead_reckoned_yaw_rad},
                     {},
                     msg.chain};
  if (msg.has_heading_sigma || !IsSigma(msg.heading_sigma_rad))
    vertex.heading_sigma_rad = msg.heading_sigma_rad;
  return vertex;
}

graph_edge_t ToLcm(const GraphEdge& edge) {
  graph_edge_t msg{};
  msg.from_id = edge.from.value;
  msg.to_id = edge.to.value;
  msg.kind = static_cast<std::int8_t>(edge.kind);
  msg.verdict = static_cast<std::int8_t>(edge.verdict);
  msg.x_m = edge.T_from_to.x;
  msg.y_m = edge.T_from_to.y;
  msg.yaw_rad = edge.T_from_to.yaw;
  MatrixTo<3>(edge.information, msg.information);
  msg.z_offset_m = edge.z_offset_m;
  msg.rms_m = edge.rms_m;
  msg.overlap_m2 = edge.overlap_m2;
  msg.overlap_center_x_m = edge.overlap_center_m.x();
  msg.overlap_center_y_m = edge.overlap_center_m.y();
  msg.dvl_yaw_rad = edge.dvl_yaw_rad;
  return msg;
}

GraphEdge FromLcm(const graph_edge_t& msg) {
  GraphEdge edge;
  edge.kind = static_cast<EdgeKind>(msg.kind);
  edge.from = SubmapId{msg.from_id};
  edge.to = SubmapId{msg.to_id};
  edge.T_from_to = {msg.x_m, msg.y_m, msg.yaw_rad};
  edge.information = MatrixFrom<3>(msg.information);
  edge.verdict = static_cast<LoopVerdict>(msg.verdict);
  edge.z_offset_m = msg.z_offset_m;
  edge.rms_m = msg.rms_m;
  edge.overlap_m2 = msg.overlap_m2;
  edge.overlap_center_m = {msg.overlap_center_x_m, msg.overlap_center_y_m};
  edge.dvl_yaw_rad = msg.dvl_yaw_rad;
  return edge;
}

solved_vertex_t ToLcm(const SolvedVertex& vertex) {
  solved_vertex_t msg{};
  msg.id = vertex.id.value;
  msg.x_m = vertex.T_map_level.x;
  msg.y_m = vertex.T_map_level.y;
  msg.yaw_rad = vertex.T_map_level.yaw;
  MatrixTo<3>(vertex.covariance, msg.covariance);
  MatrixTo<3>(vertex.covariance_with_newest, msg.covariance_with_newest);
  return msg;
}

SolvedVertex FromLcm(const solved_vertex_t& msg) {
  return {SubmapId{msg.id},
          {msg.x_m, msg.y_m, msg.yaw_rad},
          MatrixFrom<3>(msg.covariance),
          MatrixFrom<3>(msg.covariance_with_newest)};
}

solved_edge_t ToLcm(const SolvedEdge& edge) {
  solved_edge_t msg{};
  msg.from_id = edge.from.value;
  msg.to_id = edge.to.value;
  msg.weight = edge.weight;
  return msg;
}

SolvedEdge FromLcm(const solved_edge_t& msg) {
  return {SubmapId{msg.from_id}, SubmapId{msg.to_id}, msg.weight};
}

using MountingOfDive = std::pair<std::int32_t, MountingErrors>;  // chain number

mounting_errors_t ToLcm(const MountingOfDive& mounting) {
  const auto& [chain, errors] = mounting;
  mounting_errors_t msg{};
  msg.chain = chain;
  msg.sonar_forward_m = errors.sonar_m.x();
  msg.sonar_starboard_m = errors.sonar_m.y();
  msg.dvl_yaw_rad = errors.dvl_yaw_rad;
  MatrixTo<3>(errors.covariance, msg.covariance);
  return msg;
}

MountingOfDive FromLcm(const mounting_errors_t& msg) {
  return {msg.chain,
          MountingErrors{{msg.sonar_forward_m, msg.sonar_starboard_m},
                         msg.dvl_yaw_rad,
                         MatrixFrom<3>(msg.covariance)}};
}

pair_covariance_t ToLcm(const PairCovariance& pair) {
  pair_covariance_t msg{};
  msg.a_id = pair.a.value;
  msg.b_id = pair.b.value;
  MatrixTo<3>(pair.covariance, msg.covariance);
  return msg;
}

PairCovariance FromLcm(const pair_covariance_t& msg) {
  return {SubmapId{msg.a_id}, SubmapId{msg.b_id}, MatrixFrom<3>(msg.covariance)};
}

template <class Core>
auto ListToLcm(const std::vector<Core>& list) {
  std::vector<decltype(ToLcm(list[0]))> messages;
  for (const Core& element : list) messages.push_back(ToLcm(element));
  return messages;
}

// Converts and appends every element of a list. False if the list's length differs from `count`.
template <class Msg, class Core>
bool AppendFromLcm(const std::vector<Msg>& list, std::int32_t count, std::vector<Core>* out) {
  if (count < 0 || list.size() != static_cast<std::size_t>(count)) return false;
  for (const Msg& msg : list) out->push_back(FromLcm(msg));
  return true;
}

// False where a dive is there twice.
bool AppendMountings(const pose_graph_t& msg, std::map<std::int32_t, MountingErrors>* mounting) {
  std::vector<MountingOfDive> mountings;
  if (!AppendFromLcm(msg.mountings, msg.num_mountings, &mountings)) return false;
  return std::all_of(mountings.begin(), mountings.end(), [mounting](const MountingOfDive& of_dive) {
    return mounting->insert(of_dive).second;
  });
}

bool HasPlausibleParts(const pose_graph_t& msg) {
  return msg.graph_version >= 0 && msg.solution_number >= 0 &&
         ArePlausibleParts(msg.part, msg.num_parts);
}

}  // namespace

graph_update_t ToLcm(const GraphUpdate& update, Time newest_submap, std::int64_t seq) {
  graph_update_t msg{};
  msg.utime = ToUtime(newest_submap);
  msg.seq = seq;
  msg.graph_id = update.graph_id;
  msg.version = update.version;
  msg.is_final = update.final;
  msg.is_resumed = update.resumed;
  msg.sonar_sigma_m = update.mounting.sonar_m;
  msg.dvl_yaw_sigma_rad = update.mounting.dvl_yaw_rad;
  msg.num_vertices = static_cast<std::int32_t>(update.vertices.size());
  msg.num_edges = static_cast<std::int32_t>(update.edges.size());
  msg.vertices = ListToLcm(update.vertices);
  msg.edges = ListToLcm(update.edges);
  return msg;
}

std::optional<GraphUpdate> UncheckedFromLcm(const graph_update_t& msg) {
  if (!IsTime(FromUtime(msg.utime))) return std::nullopt;
  GraphUpdate update;
  update.graph_id = msg.graph_id;
  update.version = msg.version;
  update.final = msg.is_final != 0;
  update.resumed = msg.is_resumed != 0;
  update.mounting = {msg.sonar_sigma_m, msg.dvl_yaw_sigma_rad};
  if (!AppendFromLcm(msg.vertices, msg.num_vertices, &update.vertices) ||
      !AppendFromLcm(msg.edges, msg.num_edges, &update.edges))
    return std::nullopt;
  return update;
}

std::optional<GraphUpdate> FromLcm(const graph_update_t& msg) {
  std::optional<GraphUpdate> update = UncheckedFromLcm(msg);
  return update ? Checked(*std::move(update)) : std::nullopt;
}

std::vector<pose_graph_t> ToLcm(const PoseGraph& graph,
                                std::int64_t solution_number,
                                Time newest_submap,
                                std::int64_t first_seq) {
  const std::size_t num_parts = std::max({std::size_t{1},
                                          PartsFor(graph.vertices.size(), kVerticesPerPart),
                                          PartsFor(graph.loop_edges.size(), kEdgesPerPart),
                                          PartsFor(graph.mounting.size(), kMountingsPerPart)});
  const std::vector<MountingOfDive> mountings(graph.mounting.begin(), graph.mounting.end());
  std::vector<pose_graph_t> parts;
  for (std::size_t part = 0; part < num_parts; ++part) {
    pose_graph_t msg{};
    msg.utime = ToUtime(newest_submap);
    msg.seq = first_seq + static_cast<std::int64_t>(part);
    msg.graph_version = graph.graph_version;
    msg.graph_id = graph.graph_id;
    msg.solution_number = solution_number;
    msg.part = static_cast<std::int32_t>(part);
    msg.num_parts = static_cast<std::int32_t>(num_parts);
    msg.vertices = ListToLcm(PartOf(graph.vertices, part, kVerticesPerPart));
    msg.loop_edges = ListToLcm(PartOf(graph.loop_edges, part, kEdgesPerPart));
    msg.mountings = ListToLcm(PartOf(mountings, part, kMountingsPerPart));
    msg.num_vertices = static_cast<std::int32_t>(msg.vertices.size());
    msg.num_loop_edges = static_cast<std::int32_t>(msg.loop_edges.size());
    msg.num_mountings = static_cast<std::int32_t>(msg.mountings.size());
    parts.push_back(std::move(msg));
  }
  return parts;
}

covariance_request_t ToLcm(const CovarianceRequest& request, Time newest_submap) {
  covariance_request_t msg{};
  msg.utime = ToUtime(newest_submap);
  msg.seq = request.seq;
  msg.sender = request.sender.substr(0, kMaxProcessName);
  msg.graph_version = request.graph_version;
  msg.graph_id = request.graph_id;
  const auto pairs = PartOf(request.pairs, 0, kMaxCovariancePairs);
  msg.num_pairs = static_cast<std::int32_t>(pairs.size());
  for (const auto& [a, b] : pairs) {
    msg.a_id.push_back(a.value);
    msg.b_id.push_back(b.value);
  }
  return msg;
}

std::optional<CovarianceRequest> FromLcm(const covariance_request_t& msg) {
  const auto count = static_cast<std::size_t>(std::max(0, msg.num_pairs));
  if (!IsTime(FromUtime(msg.utime)) || msg.num_pairs > kMaxCovariancePairs ||
      msg.sender.size() > kMaxProcessName || msg.a_id.size() != count || msg.b_id.size() != count)
    return std::nullopt;
  CovarianceRequest request{msg.sender, msg.seq, msg.graph_version, {}, msg.graph_id};
  for (std::size_t k = 0; k < count; ++k)
    request.pairs.emplace_back(SubmapId{msg.a_id[k]}, SubmapId{msg.b_id[k]});
  return Checked(std::move(request));
}

covariances_t ToLcm(const PairCovariances& answer, Time newest_submap, std::int64_t seq) {
  covariances_t msg{};
  msg.utime = ToUtime(newest_submap);
  msg.seq = seq;
  msg.recipient = answer.recipient.substr(0, kMaxProcessName);
  msg.request_seq = answer.request_seq;
  msg.graph_version = answer.graph_version;
  msg.graph_id = answer.graph_id;
  msg.pairs = ListToLcm(PartOf(answer.pairs, 0, kMaxCovariancePairs));
  msg.num_pairs = static_cast<std::int32_t>(msg.pairs.size());
  return msg;
}

std::optional<PairCovariances> FromLcm(const covariances_t& msg) {
  PairCovariances answer{msg.recipient, msg.request_seq, msg.graph_version, {}, msg.graph_id};
  if (!IsTime(FromUtime(msg.utime)) || msg.num_pairs > kMaxCovariancePairs ||
      msg.recipient.size() > kMaxProcessName ||
      !AppendFromLcm(msg.pairs, msg.num_pairs, &answer.pairs))
    return std::nullopt;
  return Checked(std::move(answer));
}

std::optional<PoseGraph> PoseGraphAssembler::Add(const pose_graph_t& msg) {
  const bool begins = msg.part == 0;
  const bool continues = open_ && msg.solution_number == solution_number_ &&
                         msg.graph_version == open_->graph_version &&
                         msg.graph_id == open_->graph_id && msg.num_parts == num_parts_ &&
                         msg.part == next_part_;
  if (begins && open_) ++malformed_;  // the last part of the previous solution was lost
  if (!HasPlausibleParts(msg) || !(begins || continues)) {
    ++malformed_;
    open_.reset();
    return std::nullopt;
  }
  if (begins) {
    open_ = PoseGraph{msg.graph_version, {}, {}, {}, msg.graph_id};
    solution_number_ = msg.solution_number;
    num_parts_ = msg.num_parts;
  }
  next_part_ = msg.part + 1;
  if (!AppendFromLcm(msg.vertices, msg.num_vertices, &open_->vertices) ||
      !AppendFromLcm(msg.loop_edges, msg.num_loop_edges, &open_->loop_edges) ||
      !AppendMountings(msg, &open_->mounting)) {
    ++malformed_;
    open_.reset();
    return std::nullopt;
  }
  if (next_part_ < num_parts_) return std::nullopt;
  std::optional<PoseGraph> checked = Checked(*std::exchange(open_, std::nullopt));
  if (!checked) ++malformed_;
  return checked;
}

}  // namespace seastitch
