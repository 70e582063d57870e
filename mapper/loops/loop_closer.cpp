#include "mapper/loops/loop_closer.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/information.hpp"

namespace seastitch {
namespace {

// Lower bound of the variances of a prior, whatever a file states: a prior without uncertainty
// would leave nothing to search, and its inverse would not exist.
const Eigen::Vector3d kSmallestVariance(1e-4, 1e-4, 1e-8);  // 1 cm, 0.006 degrees

Eigen::Matrix3d WithFloor(const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d floored = 0.5 * (covariance + covariance.transpose());
  floored.diagonal() += kSmallestVariance;
  return floored;
}

// Where nothing is known of how two submaps lie to each other: 1 km and half a circle, one sigma.
// An edge of it keeps the graph in one piece and pulls at nothing.
const Eigen::Vector3d kUnknownVariance(1e6, 1e6, kPi* kPi);

bool IsAccepted(const GraphEdge& edge) { return edge.verdict == LoopVerdict::kAccepted; }

// See kRetryNats. Covariances above kSmallestVariance.
double InformationGain(const RelativePose& before, const RelativePose& now) {
  Eigen::Vector3d moved = now.T_a_b.Vector() - before.T_a_b.Vector();
  moved[2] = WrapAngle(moved[2]);
  const double narrowed = std::log(before.covariance.determinant() / now.covariance.determinant());
  return 0.5 * (narrowed + moved.dot(before.covariance.ldlt().solve(moved)));
}

bool AreFinite(const std::map<std::int32_t, MountingErrors>& mounting) {
  return std::all_of(mounting.begin(), mounting.end(), [](const auto& of_dive) {
    return of_dive.second.Vector().allFinite() && of_dive.second.covariance.allFinite();
  });
}

bool IsFinite(const SolvedVertex& v) {
  return v.T_map_level.Vector().allFinite() && v.covariance.allFinite() &&
         v.covariance_with_newest.allFinite();
}

// An overlap at the frame itself still reaches so far on both sides of it.
constexpr double kShortestArmM = 3.0;

}  // namespace

void LoopCloser::Add(const Submap& submap, const Chain& chain) {
  entries_.push_back({OutlineOf(submap),
                      LevelPose(submap.T_map_submap),
                      submap.T_map_submap.translation().z(),
                      submap.heading_spread,
                      submap.drift_per_m,
                      submap.dvl_yaw_rad,
                      submap.T_previous_level,
                      submap.covariance_from_previous,
                      chain,
                      std::nullopt});
  mapped_ += HasSoundings(submap.trigger) ? 1 : 0;
  newest_yaw_rad_[chain.number] = submap.dvl_yaw_rad;
}

bool LoopCloser::IsUsable(const PoseGraph& graph) const {
  if (graph.vertices.size() > entries_.size() || !AreFinite(graph.mounting)) return false;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    const SolvedVertex& vertex = graph.vertices[i];
    if (vertex.id != entries_[i].outline.id || !IsFinite(vertex)) return false;
  }
  return true;
}

bool LoopCloser::SetSolution(const PoseGraph& graph) {
  if (!IsUsable(graph)) return false;
  solution_version_ = graph.graph_version;
  solved_ = graph.vertices;
  mounting_ = graph.mounting;
  for (const SolvedEdge& edge : graph.loop_edges) {
    const auto found = tried_.find({edge.from, edge.to});
    if (found == tried_.end()) continue;
    Tried& tried = found->second;
    tried.pulls = tried.edge && IsAccepted(*tried.edge) && edge.weight > 0.0;
  }
  FindMoved();
  return true;
}

void LoopCloser::FindMoved() {
  std::vector<std::pair<double, std::size_t>> gained;
  for (std::size_t i = 0; i < solved_.size(); ++i) {
    const RelativePose now = AsSolved(i);
    const std::optional<RelativePose>& before = entries_[i].looked_at;
    // A small part of the gain of a pair suffices: its submaps may have gained most of it together.
    const double nats =
        before ? InformationGain(*before, now) : std::numeric_limits<double>::infinity();
    if (nats >= 0.05 * kRetryNats) gained.push_back({nats, i});
  }
  // Submaps without a pair are skipped, and others taken in their place.
  const std::size_t most = std::min(gained.size(), 4 * kMaxRetried);
  std::partial_sort(gained.begin(),
                    gained.begin() + static_cast<std::ptrdiff_t>(most),
                    gained.end(),
                    std::greater<>());
  moved_.clear();
  covariances_.clear();
  request_ = {{}, 0, solution_version_, {}};
  for (std::size_t k = 0; k < most && moved_.size() < kMaxRetried; ++k) {
    const std::size_t n = gained[k].second;
    const std::vector<std::size_t> within = WithinReach(n);
    for (const std::size_t i : within)
      request_.pairs.emplace_back(entries_[i].outline.id, entries_[n].outline.id);
    if (within.empty())
      entries_[n].looked_at = AsSolved(n);
    else
      moved_.push_back(n);
  }
  std::reverse(moved_.begin(), moved_.end());
}

RelativePose LoopCloser::AsSolved(std::size_t i) const {
  return {solved_[i].T_map_level, WithFloor(solved_[i].covariance)};
}

std::vector<std::size_t> LoopCloser::WithinReach(std::size_t n) const {
  const auto spread_m = [this](std::size_t i) {
    return 3.0 * WorstSigma(solved_[i].covariance.topLeftCorner<2, 2>());
  };
  const double spread_of_n_m = spread_m(n);
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < n; ++i) {
    const auto found = tried_.find({entries_[i].outline.id, entries_[n].outline.id});
    if (found != tried_.end() && found->second.pulls) continue;
    const double apart_m =
        (solved_[i].T_map_level.Translation() - solved_[n].T_map_level.Translation()).norm() -
        entries_[i].outline.radius_m - entries_[n].outline.radius_m;
    // However the errors of the two go together, their difference spreads by no more than the sum.
    if (apart_m <= spread_m(i) + spread_of_n_m) near.push_back({apart_m, i});
  }
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), kMaxPairsToRetry));
  std::vector<std::size_t> within;
  for (const auto& [apart_m, i] : near) within.push_back(i);
  return within;
}

void LoopCloser::SetCovariances(const PairCovariances& answer) {
  if (answer.graph_version != request_.graph_version) return;
  covariances_ = answer.pairs;
  request_.pairs.clear();
}

std::vector<LoopPair> LoopCloser::PairsFor(SubmapId source) const {
  const std::size_t n = IndexOf(source);
  if (n == entries_.size()) return {};
  const SubmapId map_begins_at = entries_[n].chain.map_begins_at;
  const std::size_t num_targets = map_begins_at.value < 0 ? n : IndexOf(map_begins_at);
  const std::vector<RelativePose> priors = Priors(n);
  std::vector<OverlapCandidate> candidates;
  for (std::size_t i = 0; i < num_targets; ++i) {
    candidates.push_back(
        JudgePair(entries_[i].outline, entries_[n].outline, priors[i], params_.expected_overlap));
  }
  return Choose(n, std::move(candidates));
}

std::vector<LoopPair> LoopCloser::PairsToRetry(int most) {
  const std::size_t n = moved_.back();
  moved_.pop_back();
  entries_[n].looked_at = AsSolved(n);
  std::vector<OverlapCandidate> candidates;
  for (const PairCovariance& pair : covariances_) {
    const std::size_t i = IndexOf(pair.a);
    if (pair.b != entries_[n].outline.id || i >= n) continue;
    const RelativePose prior{Inverse(solved_[i].T_map_level) * solved_[n].T_map_level,
                             WithFloor(pair.covariance)};
    if (Eigen::LLT<Eigen::Matrix3d>(prior.covariance).info() != Eigen::Success) continue;
    if (!IsUntriedUnder(prior, pair.a, pair.b)) continue;
    const OverlapCandidate candidate =
        JudgePair(entries_[i].outline, entries_[n].outline, prior, params_.expected_overlap);
    if (candidate.gain_nats >= kRetryNats) candidates.push_back(candidate);
  }
  std::vector<LoopPair> pairs = Choose(n, std::move(candidates));
  if (pairs.size() > static_cast<std::size_t>(most)) pairs.erase(pairs.begin() + most, pairs.end());
  return pairs;
}

bool LoopCloser::IsUntriedUnder(const RelativePose& prior, SubmapId target, SubmapId source) const {
  const auto found = tried_.find({target, source});
  if (found == tried_.end()) return true;
  const Tried& tried = found->second;
  return !tried.pulls && InformationGain(tried.prior, prior) >= kRetryNats;
}

std::vector<LoopPair> LoopCloser::Choose(std::size_t n,
                                         std::vector<OverlapCandidate> candidates) const {
  std::vector<LoopPair> pairs;
  for (const OverlapCandidate& c : ChoosePairs(std::move(candidates), params_.overlap)) {
    pairs.push_back(PairOf(c.target, entries_[n].outline.id, c.prior));
  }
  return pairs;
}

LoopPair LoopCloser::PairOf(SubmapId target, SubmapId source, const RelativePose& prior) const {
  const std::size_t a = IndexOf(target);
  const std::size_t b = IndexOf(source);
  return {target,
          source,
          prior,
          entries_[b].z_m - entries_[a].z_m,
          LearntYaw(a),
          LearntYaw(b),
          newest_yaw_rad_.at(entries_[b].chain.number)};
}

double LoopCloser::LearntYaw(std::size_t i) const {
  return newest_yaw_rad_.at(entries_[i].chain.number) - entries_[i].dvl_yaw_rad;
}

std::vector<GraphEdge> LoopCloser::Record(const std::vector<LoopPair>& pairs,
                                          const std::vector<GraphEdge>& edges) {
  for (const LoopPair& pair : pairs) tried_[{pair.target, pair.source}].prior = pair.prior;
  std::vector<GraphEdge> changed;
  for (GraphEdge edge : edges) {
    edge.information = InformationDespiteBends(edge);
    Tried& tried = tried_[{edge.from, edge.to}];
    if (IsAccepted(edge) || !tried.edge || tried.edge->verdict != edge.verdict)
      changed.push_back(edge);
    accepted_ += IsAccepted(edge) - (tried.edge && IsAccepted(*tried.edge));
    tried.edge = edge;
    tried.pulls = IsAccepted(edge);
  }
  return changed;
}

std::optional<GraphEdge> LoopCloser::Restate(SubmapId target,
                                             SubmapId source,
                                             const Eigen::Matrix3d& information) {
  const auto found = tried_.find({target, source});
  if (found == tried_.end() || !found->second.edge || !IsAccepted(*found->second.edge))
    return std::nullopt;
  GraphEdge& edge = *found->second.edge;
  edge.information = information;
  edge.information = InformationDespiteBends(edge);
  return edge;
}

std::optional<LoopPair> LoopCloser::PairAgain(SubmapId target, SubmapId source) const {
  const auto found = tried_.find({target, source});
  if (found == tried_.end()) return std::nullopt;
  return PairOf(target, source, found->second.prior);
}

bool LoopCloser::IsRepetition(const LoopPair& pair) const {
  const auto found = tried_.find({pair.target, pair.source});
  if (found == tried_.end() || !found->second.edge || !IsAccepted(*found->second.edge))
    return false;
  const RelativePose& prior = found->second.prior;
  return prior.T_a_b.Vector() == pair.prior.T_a_b.Vector() &&
         prior.covariance == pair.prior.covariance;
}

Eigen::Matrix3d LoopCloser::InformationDespiteBends(const GraphEdge& edge) const {
  std::map<std::int32_t, double> spread2;  // by chain: one offset bends all submaps of a dive
  for (const SubmapId id : {edge.from, edge.to}) {
    const Entry& entry = entries_[IndexOf(id)];
    spread2[entry.chain.number] += std::pow(entry.heading_spread, 2);
  }
  double bend_m2 = 0.0;
  for (const auto& [chain, of_dive] : spread2) {
    const MountingErrors& mounting = MountingOf(chain);
    const double offset_m2 =
        0.5 * (mounting.sonar_m.squaredNorm() + mounting.covariance.topLeftCorner<2, 2>().trace());
    bend_m2 += offset_m2 * of_dive;
  }
  const Eigen::Vector2d center_to_m = Inverse(edge.T_from_to) * edge.overlap_center_m;
  const auto drift_m = [&](SubmapId id, const Eigen::Vector2d& center_m) {
    return entries_[IndexOf(id)].drift_per_m * std::max(std::abs(center_m.x()), kShortestArmM);
  };
  bend_m2 += std::pow(drift_m(edge.from, edge.overlap_center_m), 2) +
             std::pow(drift_m(edge.to, center_to_m), 2);
  const std::optional<SqrtInformation> root = FactorInformation(edge.information);
  if (bend_m2 == 0.0 || !root) return edge.information;
  // Both covariances together, where the information may be singular.
  const Eigen::Matrix<double, 3, 2> W = root->W.leftCols<2>();
  const Eigen::Matrix3d both = Eigen::Matrix3d::Identity() + bend_m2 * W * W.transpose();
  const Eigen::Matrix3d information = root->W.transpose() * both.inverse() * root->W;
  return 0.5 * (information + information.transpose());
}

std::vector<GraphEdge> LoopCloser::DeadReckoningEdge(SubmapId to) const {
  const std::size_t n = IndexOf(to);
  if (n == entries_.size() || BeginsChain(n)) return {};
  const RelativePose relative = StatedFromPrevious(n);
  GraphEdge edge;
  edge.kind = EdgeKind::kDeadReckoning;
  edge.from = entries_[n - 1].outline.id;
  edge.to = to;
  edge.T_from_to = relative.T_a_b;
  edge.dvl_yaw_rad = entries_[n].dvl_yaw_rad;
  edge.information = WithFloor(relative.covariance).inverse();
  return {edge};
}

bool LoopCloser::Has(SubmapId id) const { return IndexOf(id) < entries_.size(); }

SubmapId LoopCloser::newest_solved() const {
  return solved_.empty() ? SubmapId{} : solved_.back().id;
}

std::size_t LoopCloser::IndexOf(SubmapId id) const {
  const auto found =
      std::lower_bound(entries_.begin(), entries_.end(), id, [](const Entry& e, SubmapId wanted) {
        return e.outline.id < wanted;
      });
  const bool here = found != entries_.end() && found->outline.id == id;
  return here ? static_cast<std::size_t>(found - entries_.begin()) : entries_.size();
}

RelativePose LoopCloser::FromPrevious(std::size_t i) const {
  const RelativePose stated = StatedFromPrevious(i);
  const Eigen::Matrix3d by = DeadReckoningByMounting(stated.T_a_b);
  const MountingErrors& mounting = MountingOf(entries_[i].chain.number);
  const Eigen::Vector3d mean =
      stated.T_a_b.Vector() + by * mounting.Vector() + LearntYaw(i) * by.col(2);
  return {{mean.x(), mean.y(), mean.z()},
          stated.covariance + by * mounting.covariance * by.transpose()};
}

const MountingErrors& LoopCloser::MountingOf(std::int32_t chain) const {
  static const MountingErrors kNone;
  const auto found = mounting_.find(chain);
  return found == mounting_.end() ? kNone : found->second;
}

RelativePose LoopCloser::StatedFromPrevious(std::size_t i) const {
  const Eigen::Matrix3d unknown = kUnknownVariance.asDiagonal();
  return {entries_[i].T_previous_level.value_or(Inverse(entries_[i - 1].T_map_level) *
                                                entries_[i].T_map_level),
          entries_[i].covariance_from_previous.value_or(unknown)};
}

bool LoopCloser::BeginsChain(std::size_t i) const {
  return i == 0 || entries_[i].chain.number != entries_[i - 1].chain.number;
}

RelativePose LoopCloser::BetweenChains(std::size_t i, std::size_t n) const {
  const Eigen::Matrix3d unknown = kUnknownVariance.asDiagonal();
  const Chain& chain = entries_[n].chain;
  const Pose2& T_map_i = solved_[i].T_map_level;
  const Pose2 T_map_n = SoundingPose(entries_[n].T_map_level, MountingOf(chain.number));
  Eigen::Matrix3d covariance = chain.start_covariance.value_or(unknown);
  covariance.diagonal().head<2>().array() += chain.mounting.sonar_m * chain.mounting.sonar_m;
  return {Inverse(T_map_i) * T_map_n,
          RelativeCovariance(
              T_map_i, T_map_n, solved_[i].covariance, covariance, Eigen::Matrix3d::Zero())};
}

std::vector<RelativePose> LoopCloser::Priors(std::size_t n) const {
  // By dead reckoning back from n; where the solution begins it carries the rest of the way, and
  // where a chain does its place in the map. The solution's cross-covariances are with its own
  // newest, which must be before n.
  const std::size_t num_solved = solved_.size() <= n ? solved_.size() : 0;
  const Eigen::Matrix3d unknown = kUnknownVariance.asDiagonal();
  std::vector<RelativePose> priors(n);
  RelativePose way;  // T_reached_n
  std::size_t reached = n;
  while (reached >= std::max<std::size_t>(num_solved, 1) && !BeginsChain(reached)) {
    way = Compose(FromPrevious(reached), way);
    priors[--reached] = way;
  }
  for (std::size_t i = 0; i < reached; ++i) {
    if (i >= num_solved) {
      priors[i] = {Inverse(entries_[i].T_map_level) * entries_[n].T_map_level, unknown};
    } else if (reached >= num_solved) {
      priors[i] = Compose(BetweenChains(i, reached), way);
    } else {
      const SolvedVertex& newest = solved_[reached];
      const SolvedVertex& v = solved_[i];
      const RelativePose to_newest{Inverse(v.T_map_level) * newest.T_map_level,
                                   RelativeCovariance(v.T_map_level,
                                                      newest.T_map_level,
                                                      v.covariance,
                                                      newest.covariance,
                                                      v.covariance_with_newest)};
      priors[i] = Compose(to_newest, way);
    }
  }
  for (RelativePose& prior : priors) prior.covariance = WithFloor(prior.covariance);
  return priors;
}

}  // namespace seastitch
