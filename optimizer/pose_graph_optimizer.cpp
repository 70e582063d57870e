#include "optimizer/pose_graph_optimizer.hpp"

#include <algorithm>
#include <bit>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

#include "optimizer/robust_solver.hpp"

namespace seastitch {
namespace {

// Further from the datum is no survey but a broken number; squares of it must stay finite.
constexpr double kMaxCoordinateM = 1e7;

bool IsUsable(const Pose2& pose) {
  return std::abs(pose.x) <= kMaxCoordinateM && std::abs(pose.y) <= kMaxCoordinateM &&
         std::abs(pose.yaw) <= kMaxCoordinateM;  // this way round NaN is refused
}

// Where the position of the first submap is what the map is laid out from.
constexpr double kHeld_m = 1e-3;
constexpr double kHeld_rad = 1e-5;

Eigen::Matrix3d InverseSigmas(double sigma_m, double sigma_yaw_rad) {
  return Eigen::Vector3d(1.0 / sigma_m, 1.0 / sigma_m, 1.0 / sigma_yaw_rad).asDiagonal();
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
    print.Add(vertex.heading_sigma_rad);
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

// Of loop closures by the numbers of their vertices, smaller first, rising: how many, itself
// included, have both ends at most one submap from those of each (not from one another's: a chain
// of neighbours is no cluster). They see the same seabed in the same places and may be wrong alike.
std::vector<int> ClusterSizes(const std::vector<std::pair<int, int>>& closures) {
  std::vector<int> sizes(closures.size(), 0);
  for (const int step : {-1, 0, 1}) {
    auto begin = closures.begin();
    auto end = closures.begin();
    for (std::size_t k = 0; k < closures.size(); ++k) {
      const auto& [a, b] = closures[k];
      while (begin != closures.end() && *begin < std::pair{a + step, b - 1}) ++begin;
      while (end != closures.end() && *end <= std::pair{a + step, b + 1}) ++end;
      sizes[k] += static_cast<int>(end - begin);
    }
  }
  return sizes;
}

std::string MustBePositive(const char* key, double value) {
  if (value > 0.0 && std::isfinite(value)) return {};
  return std::string(key) + " = " + std::to_string(value) + ", must be > 0";
}

// A plain factor by its vertices, and which it is of those between the same two.
using PlainKey = std::tuple<int, int, int>;
std::vector<PlainKey> PlainKeys(const FactorGraph& graph, std::size_t num_plain) {
  std::map<std::pair<int, int>, int> before;
  std::vector<PlainKey> keys;
  for (std::size_t k = 0; k < num_plain; ++k) {
    const Factor& f = graph.factors[k];
    keys.emplace_back(f.i, f.j, before[{f.i, f.j}]++);
  }
  return keys;
}

}  // namespace

std::string OptimizerParams::Validate() const {
  if (!(inlier_probability > 0.5 && inlier_probability < 1.0))
    return "inlier_probability = " + std::to_string(inlier_probability) +
           ", must be above 0.5 and below 1";
  if (!(graduation_step >= 1.1 && graduation_step <= 100.0))
    return "graduation_step = " + std::to_string(graduation_step) + ", must be 1.1 to 100";
  if (max_iterations < 1)
    return "max_iterations = " + std::to_string(max_iterations) + ", must be at least 1";
  const std::pair<const char*, double> sigmas[] = {
      {"unlinked_sigma_m", unlinked_sigma_m}, {"unlinked_sigma_yaw_deg", unlinked_sigma_yaw_rad}};
  for (const auto& [key, value] : sigmas)
    if (std::string problem = MustBePositive(key, value); !problem.empty()) return problem;
  return {};
}

PoseGraphOptimizer::PoseGraphOptimizer(const OptimizerParams& params) : params_(params) {
  threshold_[0] = std::numeric_limits<double>::infinity();
  for (int dof = 1; dof <= 3; ++dof)
    threshold_[dof] =
        boost::math::quantile(boost::math::chi_squared(dof), params.inlier_probability);
}

bool PoseGraphOptimizer::Add(const GraphUpdate& update) {
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
void PoseGraphOptimizer::SetMounting(const MountingSigmas& sigmas) {
  if (!sigmas.AreUsable())
    ++counters_["mounting_unusable"];
  else if (!sigmas.AreAllZero())
    mounting_ = sigmas;
}

bool PoseGraphOptimizer::Contradicts(const GraphUpdate& update) const {
  return update.version >= 1 && update.version <= version() &&
         fingerprints_[static_cast<std::size_t>(update.version - 1)] != FingerprintOf(update);
}

void PoseGraphOptimizer::AddVertex(const GraphVertex& vertex) {
  if (vertex.id.value < 0 || !IsUsable(vertex.dead_reckoned)) {
    ++counters_["vertices_malformed"];
    return;
  }
  const bool known = vertex.heading_sigma_rad != 0.0;
  const bool usable = known && IsHeadingSigma(vertex.heading_sigma_rad);
  if (known && !usable) ++counters_["headings_unusable"];
  const Vertex added{vertex.dead_reckoned, usable ? vertex.heading_sigma_rad : 0.0, {}};
  const auto [it, is_new] = vertices_.try_emplace(vertex.id, added);
  if (!is_new) ++counters_["vertices_duplicate"];
  if (is_new && std::next(it) != vertices_.end()) doubts_.clear();  // others' numbers change
}

const char* PoseGraphOptimizer::WhyUnusable(const GraphEdge& edge) const {
  if (!vertices_.contains(edge.from) || !vertices_.contains(edge.to)) return "edges_unknown_vertex";
  const bool to_itself = edge.from == edge.to;
  if (edge.kind == (to_itself ? EdgeKind::kLoopClosure : EdgeKind::kPositionFix))
    return "edges_self_loop";
  if (to_itself && edge.kind == EdgeKind::kDeadReckoning && edge.from != vertices_.begin()->first)
    return "edges_start_not_first";
  if (!IsUsable(edge.T_from_to)) return "edges_malformed";
  return nullptr;
}

void PoseGraphOptimizer::AddEdge(const GraphEdge& edge) {
  if (const char* reason = WhyUnusable(edge)) {
    ++counters_[reason];
    return;
  }
  Edge checked{edge, {}, {}};
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
      else if (!dead_reckoning_.insert_or_assign(pair, checked).second)
        doubts_.clear();
      break;
    case EdgeKind::kLoopClosure: loops_.insert_or_assign(pair, checked); break;
    case EdgeKind::kPositionFix: fixes_.push_back(checked); break;
  }
}

std::map<SubmapId, int> PoseGraphOptimizer::Numbering() const {
  std::map<SubmapId, int> number;
  for (const auto& [id, vertex] : vertices_)
    number.emplace_hint(number.end(), id, static_cast<int>(number.size()));
  return number;
}

Eigen::Matrix3d PoseGraphOptimizer::OfThoseSought(const Eigen::Matrix3d& by_mounting) const {
  return by_mounting * (mounting_.Vector().array() > 0.0).cast<double>().matrix().asDiagonal();
}

void PoseGraphOptimizer::AddAnchor(const HeadingInformation& headings, FactorGraph* graph) const {
  const Vertex& first = vertices_.begin()->second;
  const Eigen::Matrix3d by_mounting = OfThoseSought(PositionByMounting(first.dead_reckoned.yaw));
  const bool heading_known = first.heading_sigma_rad > 0.0;
  if (fixes_.empty() && !heading_known && !SeeksMounting()) {
    graph->fixed_vertex = 0;
    return;
  }
  double sigma_m = fixes_.empty() ? kHeld_m : params_.unlinked_sigma_m;
  if (start_) {
    graph->factors.push_back(
        {.j = 0, .cost = {start_->edge.T_from_to, start_->root.W}, .by_mounting = by_mounting});
    sigma_m = std::numeric_limits<double>::infinity();
  }
  const double sigma_yaw_rad = heading_known    ? 1.0 / std::sqrt(headings.first + headings.each)
                               : fixes_.empty() ? kHeld_rad
                                                : params_.unlinked_sigma_yaw_rad;
  graph->factors.push_back({.j = 0,
                            .cost = {first.dead_reckoned, InverseSigmas(sigma_m, sigma_yaw_rad)},
                            .by_mounting = by_mounting});
}

void PoseGraphOptimizer::AddMounting(FactorGraph* graph) const {
  if (!SeeksMounting()) return;
  graph->mounting_vertex = graph->num_vertices++;
  // Of what is not sought any weight will do: it stays zero.
  Eigen::Matrix3d W = Eigen::Matrix3d::Identity();
  for (int k = 0; k < 3; ++k)
    if (const double sigma = mounting_.Vector()(k); sigma > 0.0) W(k, k) = 1.0 / sigma;
  graph->factors.push_back({.j = graph->mounting_vertex, .cost = {{}, W}});
}

void PoseGraphOptimizer::AddDeadReckoning(const std::map<SubmapId, int>& number,
                                          FactorGraph* graph) const {
  std::vector<bool> linked(vertices_.size(), false);
  for (const auto& [pair, edge] : dead_reckoning_) {
    const GraphEdge& e = edge.edge;
    if (!edge.Pulls()) continue;
    const bool is_step = edge.root.rank == 3;
    graph->factors.push_back({.i = number.at(e.from),
                              .j = number.at(e.to),
                              .cost = {e.T_from_to, edge.root.W},
                              .is_step = is_step,
                              .by_mounting = OfThoseSought(ByMounting(e))});
    if (is_step) linked[static_cast<std::size_t>(number.at(pair.second))] = true;
  }
  int k = 1;
  for (auto before = vertices_.begin(), it = std::next(before); it != vertices_.end();
       before = it++, ++k) {
    if (linked[static_cast<std::size_t>(k)]) continue;
    const Pose2 T_before_it = Inverse(before->second.dead_reckoned) * it->second.dead_reckoned;
    graph->factors.push_back(
        {.i = k - 1,
         .j = k,
         .cost = {T_before_it,
                  InverseSigmas(params_.unlinked_sigma_m, params_.unlinked_sigma_yaw_rad)},
         .by_mounting = OfThoseSought(DeadReckoningByMounting(T_before_it))});
  }
}

HeadingInformation PoseGraphOptimizer::Headings() const {
  const double sigma_first_rad = vertices_.begin()->second.heading_sigma_rad;
  if (sigma_first_rad == 0.0) return {};
  std::vector<HeadingStep> steps;
  for (const auto& [pair, edge] : dead_reckoning_) {
    const double sigma_from_rad = vertices_.at(edge.edge.from).heading_sigma_rad;
    const double sigma_to_rad = vertices_.at(edge.edge.to).heading_sigma_rad;
    if (!edge.Pulls() || edge.root.rank < 3 || sigma_from_rad == 0.0 || sigma_to_rad == 0.0)
      continue;
    // Two errors of these sigmas are no further apart, whatever the inverse makes of an information
    // next to nothing.
    const double most = std::pow(sigma_from_rad + sigma_to_rad, 2);
    steps.push_back({sigma_from_rad * sigma_from_rad,
                     sigma_to_rad * sigma_to_rad,
                     std::min(most, edge.edge.information.inverse()(2, 2))});
  }
  return InformationOfHeadings(sigma_first_rad * sigma_first_rad, steps);
}

// Of all but the first, whose heading is the anchor's.
void PoseGraphOptimizer::AddHeadings(const HeadingInformation& headings, FactorGraph* graph) const {
  if (headings.each == 0.0) return;
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  W(2, 2) = std::sqrt(headings.each);
  int k = 1;
  for (auto it = std::next(vertices_.begin()); it != vertices_.end(); ++it, ++k) {
    if (it->second.heading_sigma_rad > 0.0)
      graph->factors.push_back({kMap, k, {it->second.dead_reckoned, W}, {}});
  }
}

std::vector<PoseGraphOptimizer::Edge*> PoseGraphOptimizer::RobustEdges() {
  std::vector<Edge*> edges;
  for (Edge& fix : fixes_)
    if (fix.Pulls()) edges.push_back(&fix);
  for (auto& [pair, loop] : loops_)
    if (loop.Pulls()) edges.push_back(&loop);
  return edges;
}

FactorGraph PoseGraphOptimizer::MakeFactorGraph(const std::map<SubmapId, int>& number,
                                                const std::vector<Edge*>& robust) const {
  FactorGraph graph;
  graph.num_vertices = static_cast<int>(number.size());
  const HeadingInformation headings = Headings();
  AddMounting(&graph);
  AddAnchor(headings, &graph);
  AddDeadReckoning(number, &graph);
  AddHeadings(headings, &graph);
  std::vector<std::pair<int, int>> closures;
  for (const Edge* edge : robust)
    if (edge->edge.kind == EdgeKind::kLoopClosure)
      closures.push_back(std::minmax({number.at(edge->edge.from), number.at(edge->edge.to)}));
  const std::vector<int> cluster_sizes = ClusterSizes(closures);
  auto cluster_size = cluster_sizes.begin();
  for (const Edge* edge : robust) {
    const GraphEdge& e = edge->edge;
    const bool is_fix = e.kind == EdgeKind::kPositionFix;
    graph.factors.push_back({.i = is_fix ? kMap : number.at(e.from),
                             .j = number.at(e.to),
                             .cost = {e.T_from_to, edge->root.W},
                             .loss = {threshold_[edge->root.rank]},
                             .cluster_size = is_fix ? 1 : *cluster_size++,
                             .by_mounting = OfThoseSought(ByMounting(e))});
  }
  return graph;
}

SolverStart PoseGraphOptimizer::Start(const FactorGraph& graph,
                                      const std::vector<Edge*>& robust) const {
  SolverStart start;
  for (const auto& [id, vertex] : vertices_) start.dead_reckoned.push_back(vertex.dead_reckoned);
  if (SeeksMounting()) start.dead_reckoned.emplace_back();
  if (!vertices_.begin()->second.solved) return start;
  const Vertex* before = nullptr;
  for (const auto& [id, vertex] : vertices_) {
    start.T_map_vertex.push_back(vertex.solved
                                     ? *vertex.solved
                                     : start.T_map_vertex.back() *
                                           (Inverse(before->dead_reckoned) * vertex.dead_reckoned));
    before = &vertex;
  }
  if (SeeksMounting()) start.T_map_vertex.push_back(solved_mounting_);
  start.weights.resize(graph.factors.size() - robust.size(), 1.0);
  for (const PlainKey& key : PlainKeys(graph, start.weights.size())) {
    const auto doubt = doubts_.find(key);
    start.doubts.push_back(doubt == doubts_.end() ? 0.0 : doubt->second);
  }
  for (const Edge* edge : robust) {
    start.weights.push_back(edge->weight);
    start.doubts.push_back(edge->doubt);
  }
  start.scale_when_chosen = scale_when_chosen_;
  return start;
}

std::int64_t PoseGraphOptimizer::position_fixes() const {
  return std::count_if(fixes_.begin(), fixes_.end(), [](const Edge& fix) { return fix.Pulls(); });
}

std::int64_t PoseGraphOptimizer::position_fixes_believed() const {
  return std::count_if(fixes_.begin(), fixes_.end(), [](const Edge& fix) {
    return fix.weight.value_or(0.0) >= kBelievedWeight;
  });
}

PoseGraph PoseGraphOptimizer::Solve() {
  PoseGraph solution;
  solution.graph_version = version();
  if (vertices_.empty()) return solution;
  const std::vector<Edge*> edges = RobustEdges();
  const FactorGraph graph = MakeFactorGraph(Numbering(), edges);
  const RobustSolution robust =
      SolveRobust(graph,
                  Start(graph, edges),
                  static_cast<int>(vertices_.size()) - 1,
                  {params_.graduation_step, params_.max_iterations, params_.inlier_probability});
  if (!robust.converged) ++counters_["solves_not_converged"];
  Keep(robust, graph, edges);
  for (const auto& [id, vertex] : vertices_) {
    SolvedVertex& solved = solution.vertices.emplace_back();
    solved.id = id;
    solved.T_map_level = {vertex.solved->x, vertex.solved->y, WrapAngle(vertex.solved->yaw)};
  }
  for (const auto& [pair, loop] : loops_)
    solution.loop_edges.push_back({loop.edge.from, loop.edge.to, loop.weight.value_or(0.0)});
  FillCovariance(robust.covariance, &solution);
  solved_version_ = version();
  return solution;
}

std::vector<PairCovariance> PoseGraphOptimizer::RelativeCovariances(
    const std::vector<std::pair<SubmapId, SubmapId>>& pairs) {
  if (solved_version_ != version() || vertices_.empty()) return {};
  const std::map<SubmapId, int> number = Numbering();
  const std::vector<Edge*> robust = RobustEdges();
  const FactorGraph graph = MakeFactorGraph(number, robust);
  const SolverStart last = Start(graph, robust);
  std::vector<double> weights;
  for (const std::optional<double>& weight : last.weights) weights.push_back(weight.value_or(0.0));
  NormalEquations equations(graph);
  equations.Linearise(last.T_map_vertex);
  if (!equations.Factorize(weights)) return {};

  std::map<SubmapId, std::vector<SubmapId>> with;  // a's by their b
  for (const auto& [a, b] : pairs)
    if (a != b && number.contains(a) && number.contains(b)) with[b].push_back(a);
  std::map<std::pair<SubmapId, SubmapId>, Eigen::Matrix3d> known;
  for (const auto& [b, list] : with) {
    const Eigen::MatrixXd with_b = equations.CovarianceWith(number.at(b));
    const Vertex& at_b = vertices_.at(b);
    for (const SubmapId a : list) {
      const Vertex& at_a = vertices_.at(a);
      const Eigen::Matrix3d cross = with_b.middleRows<3>(3 * number.at(a));
      known[{a, b}] =
          RelativeCovariance(*at_a.solved, *at_b.solved, at_a.covariance, at_b.covariance, cross);
    }
  }
  std::vector<PairCovariance> covariances;
  for (const auto& [a, b] : pairs)
    if (const auto found = known.find({a, b}); found != known.end())
      covariances.push_back({a, b, found->second});
  return covariances;
}

void PoseGraphOptimizer::Keep(const RobustSolution& solution,
                              const FactorGraph& graph,
                              const std::vector<Edge*>& robust) {
  std::size_t k = 0;
  for (auto& [id, vertex] : vertices_) vertex.solved = solution.T_map_vertex[k++];
  if (SeeksMounting()) solved_mounting_ = solution.T_map_vertex[k];
  doubts_.clear();
  const std::size_t num_plain = graph.factors.size() - robust.size();
  const std::vector<PlainKey> keys = PlainKeys(graph, num_plain);
  for (k = 0; k < num_plain; ++k)
    if (solution.doubts[k] > 0.0) doubts_[keys[k]] = solution.doubts[k];
  for (Edge* edge : robust) {
    edge->weight = solution.weights[k];
    edge->doubt = solution.doubts[k++];
  }
  scale_when_chosen_ = solution.scale_when_chosen;
}

void PoseGraphOptimizer::FillCovariance(const std::optional<GraphCovariance>& covariance,
                                        PoseGraph* solution) {
  if (!covariance) ++counters_["covariance_failed"];
  const Eigen::Vector3d unlinked(
      params_.unlinked_sigma_m, params_.unlinked_sigma_m, params_.unlinked_sigma_yaw_rad);
  for (std::size_t k = 0; k < solution->vertices.size(); ++k) {
    SolvedVertex& vertex = solution->vertices[k];
    vertex.covariance = unlinked.cwiseAbs2().asDiagonal();
    if (!covariance) continue;
    vertex.covariance = covariance->marginal[k];
    vertex.covariance_with_newest = covariance->with_newest[k];
    vertices_.at(vertex.id).covariance = vertex.covariance;
  }
  if (!SeeksMounting()) return;
  solution->mounting.sonar_m = solved_mounting_.Translation();
  solution->mounting.dvl_yaw_rad = solved_mounting_.yaw;
  const Eigen::Matrix3d before = mounting_.Vector().cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d after =
      covariance ? covariance->marginal[solution->vertices.size()] : before;
  solution->mounting.covariance = OfThoseSought(OfThoseSought(after).transpose());
}

}  // namespace seastitch
