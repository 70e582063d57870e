#include "optimizer/solver/graph_store.hpp"

#include <algorithm>
#include <boost/container_hash/hash.hpp>
#include <cmath>
#include <iterator>

namespace seastitch {
namespace {

// Coordinates beyond this are damaged numbers. Their squares must stay finite.
constexpr double kMaxCoordinateM = 1e7;

bool IsUsable(const Pose2& pose) {
  return std::abs(pose.x) <= kMaxCoordinateM && std::abs(pose.y) <= kMaxCoordinateM &&
         std::abs(pose.yaw) <= kMaxCoordinateM;  // this way round NaN is refused
}

// Hash of everything in an update that the solution depends on.
std::size_t FingerprintOf(const GraphUpdate& update) {
  std::vector<double> words{update.mounting.sonar_m, update.mounting.dvl_yaw_rad};
  const auto add = [&](const Pose2& pose) {
    words.insert(words.end(), {pose.x, pose.y, pose.yaw});
  };
  for (const GraphVertex& vertex : update.vertices) {
    words.push_back(vertex.id.value);
    words.push_back(vertex.chain);
    words.push_back(static_cast<double>(ToUtime(vertex.time)));
    words.push_back(vertex.heading_sigma_rad.value_or(0.0));
    add(vertex.dead_reckoned);
  }
  for (const GraphEdge& edge : update.edges) {
    words.push_back(edge.from.value);
    words.push_back(edge.to.value);
    words.push_back(static_cast<double>(edge.kind));
    words.push_back(static_cast<double>(edge.verdict));
    add(edge.T_from_to);
    words.insert(words.end(), edge.information.data(), edge.information.data() + 9);
    words.insert(words.end(),
                 {edge.overlap_center_m.x(), edge.overlap_center_m.y(), edge.dvl_yaw_rad});
  }
  return boost::hash_range(words.begin(), words.end());
}

bool DifferInCovarianceOnly(const GraphEdge& a, const GraphEdge& b) {
  return a.from == b.from && a.to == b.to && a.verdict == b.verdict &&
         a.T_from_to.Vector() == b.T_from_to.Vector();
}

// True: positive, not above pi, and its information is not above kMaxInformation.
bool IsHeadingSigma(double rad) {
  return rad > 0.0 && rad * rad * kMaxInformation >= 1.0 && rad <= kPi;
}

}  // namespace

bool GraphStore::Add(const GraphUpdate& update) {
  if (update.version <= version()) {
    ++counters_["updates_repeated"];
    return true;
  }
  if (update.version > version() + 1) {
    ++counters_["updates_out_of_order"];
    return false;
  }
  for (const GraphVertex& vertex : update.vertices) AddVertex(vertex);
  for (const GraphEdge& edge : update.edges) AddEdge(edge);
  SetMounting(update);
  fingerprints_.push_back(FingerprintOf(update));
  return true;
}

// Keeps the newest sigmas of a dive that are not all zero: a damaged update is taken as an empty
// one.
void GraphStore::SetMounting(const GraphUpdate& update) {
  if (!update.mounting.AreUsable()) {
    ++counters_["mounting_unusable"];
    return;
  }
  if (update.mounting.AreAllZero()) return;
  for (const GraphVertex& vertex : update.vertices)
    if (vertices_.contains(vertex.id)) mounting_[vertices_.at(vertex.id).chain] = update.mounting;
}

bool GraphStore::Contradicts(const GraphUpdate& update) const {
  return update.version >= 1 && update.version <= version() &&
         fingerprints_[static_cast<std::size_t>(update.version - 1)] != FingerprintOf(update);
}

void GraphStore::AddVertex(const GraphVertex& vertex) {
  const auto next = vertices_.upper_bound(vertex.id);
  const bool chains_rise =
      (next == vertices_.begin() || std::prev(next)->second.chain <= vertex.chain) &&
      (next == vertices_.end() || vertex.chain <= next->second.chain);
  if (vertex.id.value < 0 || !IsUsable(vertex.dead_reckoned) || !chains_rise) {
    ++counters_["vertices_malformed"];
    return;
  }
  const bool known = vertex.heading_sigma_rad.has_value();
  const bool usable = known && IsHeadingSigma(*vertex.heading_sigma_rad);
  if (known && !usable) ++counters_["headings_unusable"];
  StoredVertex added{vertex.dead_reckoned, {}, {}, vertex.chain};
  if (usable) added.heading_sigma_rad = vertex.heading_sigma_rad;
  if (!vertices_.try_emplace(vertex.id, added).second) ++counters_["vertices_duplicate"];
}

std::optional<double> GraphStore::newest_dvl_yaw_rad(std::int32_t chain) const {
  const auto newest = newest_dvl_yaw_.find(chain);
  return newest == newest_dvl_yaw_.end() ? std::nullopt : std::optional(newest->second.second);
}

void GraphStore::AddStep(const Pair& pair, const StoredEdge& step) {
  dead_reckoning_.insert_or_assign(pair, step);
  const GraphEdge& edge = step.edge;
  auto& [newest, yaw_rad] =
      newest_dvl_yaw_.try_emplace(vertices_.at(edge.to).chain, edge.to, 0.0).first->second;
  if (edge.to < newest) return;
  newest = edge.to;
  yaw_rad = edge.dvl_yaw_rad;
}

bool GraphStore::BeginsChain(SubmapId id) const {
  const auto vertex = vertices_.find(id);
  return vertex == vertices_.begin() || std::prev(vertex)->second.chain != vertex->second.chain;
}

const char* GraphStore::WhyUnusable(const GraphEdge& edge) const {
  if (!vertices_.contains(edge.from) || !vertices_.contains(edge.to)) return "edges_unknown_vertex";
  const bool to_itself = edge.from == edge.to;
  if (edge.kind == (to_itself ? EdgeKind::kLoopClosure : EdgeKind::kPositionFix))
    return "edges_self_loop";
  if (to_itself && edge.kind == EdgeKind::kDeadReckoning && !BeginsChain(edge.from))
    return "edges_start_not_first";
  if (edge.kind == EdgeKind::kDeadReckoning &&
      vertices_.at(edge.from).chain != vertices_.at(edge.to).chain)
    return "edges_between_chains";
  if (!IsUsable(edge.T_from_to)) return "edges_malformed";
  return nullptr;
}

void GraphStore::AddEdge(const GraphEdge& edge) {
  if (const char* reason = WhyUnusable(edge)) {
    ++counters_[reason];
    return;
  }
  StoredEdge checked{edge, {}, {}};
  if (checked.Pulls()) {
    const auto root = FactorInformation(edge.information);
    if (!root || root->rank == 0) {
      ++counters_["edges_bad_information"];
      return;
    }
    checked.root = *root;
  }
  const Pair pair = std::minmax(edge.from, edge.to);
  switch (edge.kind) {
    case EdgeKind::kDeadReckoning:
      if (edge.from == edge.to)
        starts_.insert_or_assign(edge.from, checked);
      else
        AddStep(pair, checked);
      break;
    case EdgeKind::kLoopClosure: {
      const auto known = loops_.find(pair);
      if (known != loops_.end() && DifferInCovarianceOnly(known->second.edge, edge))
        checked.weight = known->second.weight;
      loops_.insert_or_assign(pair, checked);
      break;
    }
    case EdgeKind::kPositionFix: fixes_.push_back(checked); break;
  }
}

std::vector<const StoredEdge*> GraphStore::RobustEdges() const {
  std::vector<const StoredEdge*> edges;
  for (const StoredEdge& fix : fixes_)
    if (fix.Pulls()) edges.push_back(&fix);
  for (const auto& [pair, loop] : loops_)
    if (loop.Pulls()) edges.push_back(&loop);
  return edges;
}

void GraphStore::KeepSolution(const std::vector<Pose2>& T_map_vertex,
                              const std::vector<double>& weights) {
  auto pose = T_map_vertex.begin();
  for (auto& [id, vertex] : vertices_) vertex.solved = *pose++;
  auto weight = weights.begin();
  for (StoredEdge& fix : fixes_)
    if (fix.Pulls()) fix.weight = *weight++;
  for (auto& [pair, loop] : loops_)
    if (loop.Pulls()) loop.weight = *weight++;
}

}  // namespace seastitch
