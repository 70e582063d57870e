#include "optimizer/graph_store.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace seastitch {
namespace {

// Further from the datum is no survey but a broken number; squares of it must stay finite.
constexpr double kMaxCoordinateM = 1e7;

bool IsUsable(const Pose2& pose) {
  return std::abs(pose.x) <= kMaxCoordinateM && std::abs(pose.y) <= kMaxCoordinateM &&
         std::abs(pose.yaw) <= kMaxCoordinateM;  // this way round NaN is refused
}

// FNV-1a over the words of what the solution depends on.
class Fingerprint {
 public:
  void Add(std::uint64_t word) {
    for (int shift = 0; shift < 64; shift += 8)
      hash_ = (hash_ ^ ((word >> shift) & 0xFF)) * 0x100000001B3ULL;
  }
  void Add(std::int64_t value) { Add(static_cast<std::uint64_t>(value)); }
  void Add(double value) { Add(std::bit_cast<std::uint64_t>(value)); }
  void Add(const Pose2& pose) {
    Add(pose.x);
    Add(pose.y);
    Add(pose.yaw);
  }
  std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

std::uint64_t FingerprintOf(const GraphUpdate& update) {
  Fingerprint print;
  for (const GraphVertex& vertex : update.vertices) {
    print.Add(std::int64_t{vertex.id.value});
    print.Add(ToUtime(vertex.time));
    print.Add(vertex.dead_reckoned);
    print.Add(vertex.heading_sigma_rad.value_or(0.0));
  }
  for (const GraphEdge& edge : update.edges) {
    print.Add(std::int64_t{edge.from.value});
    print.Add(std::int64_t{edge.to.value});
    print.Add(static_cast<std::int64_t>(edge.kind));
    print.Add(static_cast<std::int64_t>(edge.verdict));
    print.Add(edge.T_from_to);
    for (const double value : edge.information.reshaped()) print.Add(value);
    for (const double value : edge.overlap_center_m) print.Add(value);
  }
  print.Add(update.mounting.sonar_m);
  print.Add(update.mounting.dvl_yaw_rad);
  return print.hash();
}

// Within what an information may hold; beyond half a circle nothing is known.
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
  SetMounting(update.mounting);
  fingerprints_.push_back(FingerprintOf(update));
  return true;
}

// The newest that says anything: an update that came damaged is taken as an empty one.
void GraphStore::SetMounting(const MountingSigmas& sigmas) {
  if (!sigmas.AreUsable())
    ++counters_["mounting_unusable"];
  else if (!sigmas.AreAllZero())
    mounting_ = sigmas;
}

bool GraphStore::Contradicts(const GraphUpdate& update) const {
  return update.version >= 1 && update.version <= version() &&
         fingerprints_[static_cast<std::size_t>(update.version - 1)] != FingerprintOf(update);
}

void GraphStore::AddVertex(const GraphVertex& vertex) {
  if (vertex.id.value < 0 || !IsUsable(vertex.dead_reckoned)) {
    ++counters_["vertices_malformed"];
    return;
  }
  const bool known = vertex.heading_sigma_rad.has_value();
  const bool usable = known && IsHeadingSigma(*vertex.heading_sigma_rad);
  if (known && !usable) ++counters_["headings_unusable"];
  StoredVertex added{vertex.dead_reckoned, {}, {}};
  if (usable) added.heading_sigma_rad = vertex.heading_sigma_rad;
  if (!vertices_.try_emplace(vertex.id, added).second) ++counters_["vertices_duplicate"];
}

const char* GraphStore::WhyUnusable(const GraphEdge& edge) const {
  if (!vertices_.contains(edge.from) || !vertices_.contains(edge.to)) return "edges_unknown_vertex";
  const bool to_itself = edge.from == edge.to;
  if (edge.kind == (to_itself ? EdgeKind::kLoopClosure : EdgeKind::kPositionFix))
    return "edges_self_loop";
  if (to_itself && edge.kind == EdgeKind::kDeadReckoning && edge.from != vertices_.begin()->first)
    return "edges_start_not_first";
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
        start_ = checked;
      else
        dead_reckoning_.insert_or_assign(pair, checked);
      break;
    case EdgeKind::kLoopClosure: loops_.insert_or_assign(pair, checked); break;
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
