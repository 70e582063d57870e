#include "mapper/loop_closer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

namespace seastitch {
namespace {

// No navigation is better than this, whatever a file says: a prior without any doubt would leave
// nothing to search, and its inverse would not exist.
const Eigen::Vector3d kSmallestVariance(1e-4, 1e-4, 1e-8);  // 1 cm, 0.006 degrees

Eigen::Matrix3d WithFloor(const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d floored = 0.5 * (covariance + covariance.transpose());
  floored.diagonal() += kSmallestVariance;
  return floored;
}

bool IsUsable(const SolvedVertex& v) {
  return v.T_map_level.Vector().allFinite() && v.covariance.allFinite() &&
         v.covariance_with_newest.allFinite();
}

}  // namespace

std::string LoopCloserParams::Validate() const {
  if (!(z_sigma_m > 0.0)) return "z_sigma_m must be > 0";
  return {};
}

void LoopCloser::Add(const Submap& submap) {
  entries_.push_back({OutlineOf(submap),
                      LevelPose(submap.T_map_submap),
                      submap.T_map_submap.translation().z(),
                      submap.covariance_from_previous});
}

bool LoopCloser::SetSolution(const PoseGraph& graph) {
  if (graph.vertices.size() > entries_.size()) return false;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    const SolvedVertex& vertex = graph.vertices[i];
    if (vertex.id != entries_[i].outline.id || !IsUsable(vertex)) return false;
  }
  solved_ = graph.vertices;
  return true;
}

std::vector<LoopPair> LoopCloser::PairsFor(SubmapId source) const {
  const std::size_t n = IndexOf(source);
  if (n == entries_.size()) return {};
  const std::vector<RelativePose> priors = Priors(n);
  std::vector<OverlapCandidate> candidates;
  for (std::size_t i = 0; i < n; ++i) {
    candidates.push_back(
        JudgePair(entries_[i].outline, entries_[n].outline, priors[i], params_.expected_overlap));
  }
  std::vector<LoopPair> pairs;
  for (const OverlapCandidate& c : ChoosePairs(std::move(candidates), params_.overlap)) {
    const double z_prior_m = entries_[n].z_m - entries_[IndexOf(c.target)].z_m;
    pairs.push_back({c.target, source, c.prior, z_prior_m});
  }
  return pairs;
}

std::vector<GraphEdge> LoopCloser::DeadReckoningEdge(SubmapId to) const {
  const std::size_t n = IndexOf(to);
  if (n == 0 || n == entries_.size()) return {};
  const RelativePose relative = FromPrevious(n);
  GraphEdge edge;
  edge.kind = EdgeKind::kDeadReckoning;
  edge.from = entries_[n - 1].outline.id;
  edge.to = to;
  edge.T_from_to = relative.T_a_b;
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
  return {Inverse(entries_[i - 1].T_map_level) * entries_[i].T_map_level,
          entries_[i].covariance_from_previous};
}

std::vector<RelativePose> LoopCloser::Priors(std::size_t n) const {
  // By dead reckoning back from n; where the solution begins it carries the rest of the way. Its
  // cross-covariances are with its own newest, which must be before n.
  const std::size_t num_solved = solved_.size() <= n ? solved_.size() : 0;
  std::vector<RelativePose> priors(n);
  RelativePose chain;
  for (std::size_t i = n; i > 0; --i) {
    chain = Compose(FromPrevious(i), chain);
    priors[i - 1] = chain;
    if (i == num_solved) break;
  }
  if (num_solved > 0) {
    const SolvedVertex& newest = solved_[num_solved - 1];
    for (std::size_t i = 0; i + 1 < num_solved; ++i) {
      const SolvedVertex& v = solved_[i];
      const RelativePose to_newest{Inverse(v.T_map_level) * newest.T_map_level,
                                   RelativeCovariance(v.T_map_level,
                                                      newest.T_map_level,
                                                      v.covariance,
                                                      newest.covariance,
                                                      v.covariance_with_newest)};
      priors[i] = Compose(to_newest, chain);
    }
  }
  for (RelativePose& prior : priors) prior.covariance = WithFloor(prior.covariance);
  return priors;
}

std::vector<GraphEdge> RegisterPairs(const Submap& source,
                                     const std::vector<LoopPair>& pairs,
                                     const LoadSubmap& load,
                                     const LoopCloserParams& params) {
  std::vector<GraphEdge> edges;
  if (pairs.empty()) return edges;
  const auto prepare = [&](const Submap& submap) {
    return RegistrationSubmap::Prepare(
        submap.cloud, LevelFromBody(submap.T_map_submap), params.registration);
  };
  const RegistrationSubmap prepared_source = prepare(source);
  for (const LoopPair& pair : pairs) {
    const std::shared_ptr<const Submap> target = load(pair.target);
    if (target == nullptr) continue;
    edges.push_back(ToEdge(pair,
                           Register(prepare(*target),
                                    prepared_source,
                                    pair.prior.T_a_b,
                                    pair.prior.covariance,
                                    pair.z_prior_m,
                                    params.z_sigma_m,
                                    params.registration)));
  }
  return edges;
}

GraphEdge ToEdge(const LoopPair& pair, const RegistrationResult& result) {
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from = pair.target;
  edge.to = pair.source;
  edge.T_from_to = result.T_target_source;
  edge.information = result.information;
  edge.verdict = result.verdict;
  edge.z_offset_m = result.z_offset_m;
  edge.rms_m = result.rms_m;
  edge.overlap_m2 = result.overlap_m2;
  return edge;
}

}  // namespace seastitch
